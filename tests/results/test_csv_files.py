"""CSV files: exact round trip of recordings, and locations of errors."""

import csv
import math

import numpy as np
import pytest

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.core.text import MAX_TEXT_LENGTH
from cosim.results.csv_files import read_csv, write_csv

LONG = "x" * (MAX_TEXT_LENGTH + 1)


def recording(time, **columns):
    return Recording(
        np.asarray(time, float), {name: np.asarray(column) for name, column in columns.items()}, {}
    )


def written(tmp_path, text):
    path = tmp_path / "given.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_csv_has_the_documented_format(tmp_path):
    columns = {
        "plant.uav.position.x": np.array([0.1, -2.5e-7]),
        "plant.uav.contact.vessel": np.array([False, True]),
        "uav.vtol.mode": np.array([1, -3], np.int32),
        "usv.waypoint_x[1]": np.array([1e16, 1.0]),
        'log of "uav"': np.array(["take-off", 'said "go", then flew'], object),
    }
    write_csv(Recording(np.array([0.0, 0.01]), columns, {}), tmp_path / "result.csv")
    assert (tmp_path / "result.csv").read_bytes().decode() == (
        '"time","plant.uav.position.x","plant.uav.contact.vessel","uav.vtol.mode",'
        '"usv.waypoint_x[1]","log of ""uav"""\n'
        '0.0,0.1,0,1,1e+16,"take-off"\n'
        '0.01,-2.5e-7,1,-3,1.0,"said ""go"", then flew"\n'
    )


def test_every_double_returns_bit_for_bit(tmp_path):
    bits = np.random.default_rng(3).integers(0, 2**64, 20_000, dtype=np.uint64)
    edges = [
        0.0,
        -0.0,
        5e-324,
        2.2250738585072014e-308,
        1.7976931348623157e308,
        0.1 + 0.2,
        math.inf,
        -math.inf,
        math.nan,
    ]
    values = np.concatenate([bits.view(np.float64), edges])
    write_csv(recording(np.arange(values.size), x=values), tmp_path / "x.csv")
    returned = read_csv(tmp_path / "x.csv").columns["x"]
    numbers = ~np.isnan(values)
    assert np.array_equal(np.isnan(returned), ~numbers)
    assert returned[numbers].tobytes() == values[numbers].tobytes()


def test_digits_are_the_shortest_that_round_trip(tmp_path):
    values = np.random.default_rng(4).standard_normal(2000) * 10.0 ** np.arange(-1000, 1000).clip(
        -250, 250
    )
    write_csv(recording(np.arange(2000), x=values), tmp_path / "x.csv")
    with (tmp_path / "x.csv").open(newline="") as file:
        texts = [row[1] for row in csv.reader(file)][1:]
    significant = [text.split("e")[0].strip("-").replace(".", "").strip("0") for text in texts]
    expected = [
        repr(value).split("e")[0].strip("-").replace(".", "").strip("0")
        for value in values.tolist()
    ]
    assert significant == expected


def test_whole_integers_return_as_integers(tmp_path):
    limits = {
        "i": np.array([-(2**63), 2**63 - 1]),
        "u": np.array([0, 2**64 - 1], np.uint64),
        "b": np.array([True, False]),
    }
    write_csv(recording([0, 1], **limits), tmp_path / "x.csv")
    columns = read_csv(tmp_path / "x.csv").columns
    assert [columns[name].dtype for name in "iub"] == [np.int64, np.uint64, np.int64]
    assert all(columns[name].tolist() == limits[name].tolist() for name in "iub")


def test_strings_survive_a_round_trip(tmp_path):
    texts = np.array(["a,b", 'c "d"', "", "line\nbreak", "ä"], object)
    write_csv(recording(range(5), text=texts), tmp_path / "x.csv")
    assert read_csv(tmp_path / "x.csv").columns["text"].tolist() == texts.tolist()


def test_the_same_recording_gives_the_same_bytes(tmp_path):
    noise = recording(np.arange(5000) / 100, x=np.random.default_rng(0).standard_normal(5000))
    for name in ("a.csv", "b.csv"):
        write_csv(noise, tmp_path / name)
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    assert (tmp_path / "a.csv").read_text().count("\n") == 5001


def test_a_run_without_rows_keeps_its_columns(tmp_path):
    write_csv(recording([], x=[]), tmp_path / "x.csv")
    empty = read_csv(tmp_path / "x.csv")
    assert empty.time.shape == (0,)
    assert list(empty.columns) == ["x"]


def test_missing_folders_are_created_and_no_temporary_file_remains(tmp_path):
    write_csv(recording([0.0], x=[1.0]), tmp_path / "runs" / "demo" / "result.csv")
    assert [path.name for path in (tmp_path / "runs" / "demo").iterdir()] == ["result.csv"]


def test_a_failed_write_keeps_the_existing_file(tmp_path):
    path = tmp_path / "result.csv"
    path.write_text("former")
    with pytest.raises(ValueError, match="zip"):
        write_csv(recording([0.0, 1.0], x=[1.0]), path)
    assert path.read_text() == "former"
    assert [file.name for file in tmp_path.iterdir()] == ["result.csv"]


def test_an_impossible_path_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"cannot write .*file/result\.csv: .*File exists.*file'"):
        write_csv(recording([0.0], x=[1.0]), tmp_path / "file" / "result.csv")


def test_files_of_other_programs_are_read(tmp_path):
    path = written(
        tmp_path, "\ufefftime,x,state\r\n0,1,on\r\n0.5,+2.5e0,off\r\n0.5,.25,off\r\n\r\n"
    )
    foreign = read_csv(path)
    assert foreign.time.tolist() == [0.0, 0.5, 0.5]
    assert foreign.columns["x"].tolist() == [1.0, 2.5, 0.25]
    assert foreign.columns["state"].tolist() == ["on", "off", "off"]


@pytest.mark.parametrize("cell", ["2.5", "on"], ids=["numbers", "texts"])
def test_blanks_after_commas_belong_to_no_name_or_text(tmp_path, cell):
    foreign = read_csv(written(tmp_path, f'time, "x, y",  state\n0, 1, {cell}\n'))
    assert list(foreign.columns) == ["x, y", "state"]
    assert [str(foreign.columns[name][0]) for name in foreign.columns] == ["1", cell]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty, expected a header"),
        ('"t","x"\n0,1\n', r'given\.csv:1: the first column is "t", expected "time"'),
        ("time,x,x\n0,1,2\n", r'given\.csv:1: column "x" occurs more than once'),
        ("time,x\n0,1\n\n1\n", r"given\.csv:4: 1 cells, expected 2 as in the header"),
        ("time,x\n0,1\nsoon,2\n", "the column time: .*soon"),
        ("time,x\n0,1\nnan,2\n", "not finite"),
        pytest.param(
            f"time,x\n0,{LONG}x\n",
            r"given\.csv:2: cannot read the row: field larger than",
            id="long cell",
        ),
        pytest.param(
            f"time,{LONG}x\n",
            r"given\.csv:1: cannot read the row: field larger than",
            id="long name",
        ),
        pytest.param(
            f'time,x\n0,"{LONG}\n', r"given\.csv:\d: cannot read the row: ", id="quote without end"
        ),
        ("time,x\n0,1\n0.2,2\n0.1,2\n", r"time goes back from 0\.2 s to 0\.1 s"),
    ],
)
def test_unreadable_input_is_refused(tmp_path, text, message):
    with pytest.raises(InputError, match=message):
        read_csv(written(tmp_path, text))


def test_a_file_in_another_encoding_is_refused(tmp_path):
    path = tmp_path / "given.csv"
    path.write_bytes(b"time,\xe9\n0,1\n")
    with pytest.raises(
        InputError, match=r"cannot read .*given\.csv: it is not UTF-8 text: .* at byte 5"
    ):
        read_csv(path)


@pytest.mark.parametrize("length", [131_072, 131_073, MAX_TEXT_LENGTH])
def test_long_texts_are_read_as_they_were_written(tmp_path, length):
    write_csv(recording([0.0, 1.0], x=np.array(["y" * length, "z"], object)), tmp_path / "long.csv")
    assert read_csv(tmp_path / "long.csv").columns["x"].tolist() == ["y" * length, "z"]


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"cannot read .*none\.csv: No such file"):
        read_csv(tmp_path / "none.csv")
