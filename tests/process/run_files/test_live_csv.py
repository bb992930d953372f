"""CSV file of a run in progress: same bytes as the final file."""

from __future__ import annotations

import io
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from cosim.core.recording import Recording
from cosim.process.journal import JOURNAL_SIZE, ROW_COUNT, Journal, Phase
from cosim.process.run_files.folder import (
    HEADER_FILE,
    ROWS_FILE,
    TEXTS_FILE,
    Column,
    RowsHeader,
    TextReader,
    read_header,
    recover_recording,
)
from cosim.process.run_files.live_csv_writer import CsvLineReader, LiveCsvWriter
from cosim.results.csv_files import write_csv

ROWS_COUNT = 1234
KINDS = {
    "a.x": "<f8",
    'quoted "b"': "<f4",
    "flag": "|b1",
    "small": "|i1",
    "natural": "<u8",
    "whole": "<i8",
}


#: from these rows on the two texts are others
TEXTS = {
    0: {"first": "a"},
    7: {"last": 'quoted, "x"'},
    600: {"first": "", "last": "\N{SNOWMAN}\n"},
    1200: {"last": "end"},
}


@pytest.fixture
def table() -> np.ndarray:
    """Random bits in all types, with gaps between some fields and non-finite numbers."""
    offsets = [0, 8, 12, 13, 24, 32]
    dtype = np.dtype(
        {"names": list(KINDS), "formats": list(KINDS.values()), "offsets": offsets, "itemsize": 48}
    )
    rows = np.random.default_rng(5).integers(0, 256, ROWS_COUNT * 48, dtype=np.uint8).view(dtype)
    rows["flag"] = rows["small"] > 0
    rows["a.x"][:3] = np.nan, np.inf, -np.inf
    return rows


def header(table: np.ndarray) -> RowsHeader:
    """Header of the rows; one signal is recorded under two names."""
    fields = {name: table.dtype.fields[name] for name in table.dtype.names}
    columns = [
        Column(name, kind.str, offset, kind.kind == "b", "")
        for name, (kind, offset) in fields.items()
    ]
    twin = Column("twin", "<i8", fields["whole"][1], False, "")
    return RowsHeader(
        5,
        1,
        100,
        2,
        table.dtype.itemsize,
        [twin, *columns],
        [],
        [(0, "first"), (len(columns) + 2, "last")],
    )


def texts(rows: int) -> dict[str, np.ndarray]:
    columns = {name: np.full(rows, "", object) for name in ("first", "last")}
    for row, changes in TEXTS.items():
        for name, text in changes.items():
            columns[name][row:] = text
    return columns


def expected(table: np.ndarray, folder: Path, rows: int) -> bytes:
    time = np.array([(5 + 2 * n) / 100 for n in range(rows)])
    numbers = {
        "twin": table["whole"][:rows],
        **{name: table[name][:rows] for name in table.dtype.names},
    }
    first, last = texts(rows).values()
    columns = {"first": first, **numbers, "last": last}
    write_csv(Recording(time, columns, {}), folder / "expected.csv")
    return (folder / "expected.csv").read_bytes()


def write_texts(run: Path) -> None:
    (run / TEXTS_FILE).write_text("".join(json.dumps(change) + "\n" for change in TEXTS.items()))


def running(table: np.ndarray, folder: Path) -> Journal:
    """Journal of a run in the stepping loop whose rows are all in the file."""
    run = folder / "run"
    run.mkdir()
    (run / HEADER_FILE).write_text(json.dumps(asdict(header(table))))
    (run / ROWS_FILE).write_bytes(table.tobytes())
    write_texts(run)
    journal = Journal(bytearray(JOURNAL_SIZE))
    journal.set_run_files(run, folder / "result.csv")
    journal.enter_phase(Phase.STEPPING)
    return journal


def test_lines_have_the_format_of_results(table, tmp_path):
    write_texts(tmp_path)
    described = header(table)
    lines, file = (
        CsvLineReader(described, TextReader(tmp_path, described)),
        io.BytesIO(table.tobytes()),
    )
    text = lines.header_line()
    while lines.row_count < ROWS_COUNT:
        text += lines.read_lines(file, ROWS_COUNT)
    assert text == expected(table, tmp_path, ROWS_COUNT)


def test_the_file_is_complete_even_if_an_update_is_interrupted(table, tmp_path, monkeypatch):
    monkeypatch.setattr("cosim.process.run_files.live_csv_writer.FIRST_UPDATE_DELAY", 0.0)
    monkeypatch.setattr("cosim.process.run_files.live_csv_writer.UPDATE_INTERVAL", 0.0)
    journal = running(table, tmp_path)
    csv, next_lines = LiveCsvWriter(journal), CsvLineReader.read_lines
    csv.update()
    for n, rows in enumerate((1, 2, 600, 601, 1100, ROWS_COUNT)):
        journal[ROW_COUNT] = rows
        if n % 2:
            monkeypatch.setattr(
                CsvLineReader,
                "read_lines",
                lambda self, *more: next_lines(self, *more) and interrupt(),
            )
            with pytest.raises(KeyboardInterrupt):
                csv.update()
            monkeypatch.setattr(CsvLineReader, "read_lines", next_lines)
        csv.update()
        assert (tmp_path / "result.csv").read_bytes() == expected(table, tmp_path, rows)


def interrupt() -> bytes:
    raise KeyboardInterrupt


def test_strings_are_read_while_they_are_written(table, tmp_path):
    """The last line is incomplete at first; afterwards an earlier row is read again."""
    write_texts(tmp_path)
    file = tmp_path / TEXTS_FILE
    whole = file.read_bytes()
    file.write_bytes(whole[:-3])
    reader = TextReader(tmp_path, header(table))
    assert reader.read_row(599) == ["a", 'quoted, "x"']
    assert reader.read_row(1233) == ["", "\N{SNOWMAN}\n"]
    file.write_bytes(whole)
    assert reader.read_row(1233) == ["", "end"]
    assert reader.read_row(3) == ["a", ""]


def test_the_final_file_is_not_replaced(table, tmp_path):
    """The update comes after the run has left the stepping loop."""
    journal, final = running(table, tmp_path), tmp_path / "result.csv"
    journal[ROW_COUNT] = 10
    csv = LiveCsvWriter(journal)
    assert csv._open_copies(1.0) is False
    assert csv._open_copies(1.0)
    journal.enter_phase(Phase.IDLE)
    final.write_text("final")
    csv._append_rows(float("inf"))
    assert final.read_text() == "final"


@pytest.mark.parametrize(
    "line",
    [
        b"[" * 100_000,
        b"{}",
        b"[1]",
        b'["x", {}]',
        b"[1, 2]",
        b"\xff",
        b'[1, {"other": "x"}]',
        b"\0",
    ],
)
def test_a_damaged_line_of_texts_changes_nothing(table, tmp_path, line):
    write_texts(tmp_path)
    first, *others = (tmp_path / TEXTS_FILE).read_bytes().splitlines(keepends=True)
    (tmp_path / TEXTS_FILE).write_bytes(b"".join([first, line, b"\n", *others]))
    reader = TextReader(tmp_path, header(table))
    assert [reader.read_row(row) for row in range(ROWS_COUNT)] == list(
        map(list, zip(*texts(ROWS_COUNT).values(), strict=True))
    )


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        "{}",
        "[]",
        '{"columns": [1]}',
        '{"columns": [], "calls": 3, "texts": []}',
        "\0",
    ],
)
def test_a_damaged_header_counts_as_missing(tmp_path, text):
    (tmp_path / HEADER_FILE).write_text(text)
    assert read_header(tmp_path) is None
    assert len(recover_recording(tmp_path, 10).time) == 0
