"""`cosim recover` with damaged files: kept rows are never deleted before their results are written."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

import cosim
from cosim.cli import main
from cosim.process.run_files.folder import HEADER_FILE, ROWS_FILE

ROWS, SIZE = 6, 8
HEADER = {
    "origin": 0,
    "stride": 1,
    "denominator": 100,
    "steps_per_row": 1,
    "row_size": SIZE,
    "calls": [],
    "texts": [],
}
COLUMN = {"name": "a.y", "dtype": "<f8", "offset": 0, "boolean": False, "unit": ""}


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """An output directory with six rows that were kept, and the three that the run had written
    until then.
    """
    folder = tmp_path / "out" / ".unfinished"
    folder.mkdir(parents=True)
    (folder / HEADER_FILE).write_text(json.dumps({**HEADER, "columns": [COLUMN]}))
    (folder / f"{ROWS_FILE}.{ROWS}").write_bytes(bytes(ROWS * SIZE))
    (tmp_path / "out/result.csv").write_text('"time","a.y"\n0.0,0.0\n0.01,0.0\n0.02,0.0\n')
    return tmp_path / "out"


def recover(output: Path) -> int | str | None:
    with pytest.raises(SystemExit) as ended:
        main(["recover", str(output)])
    return ended.value.code


def test_intact_rows_are_recovered(output):
    assert recover(output) == 0
    assert len(cosim.Result.from_csv(output / "result.csv").time) == ROWS
    assert not (output / ".unfinished").exists()


@pytest.mark.parametrize(
    "change",
    [
        None,
        {"denominator": 0},
        {"columns": []},
        {"row_size": 0},
        {"columns": [{**COLUMN, "dtype": "x"}]},
        {"origin": []},
    ],
)
def test_a_damaged_header(output, change, capsys):
    header = output / ".unfinished" / HEADER_FILE
    header.write_text(json.dumps({**HEADER, "columns": [COLUMN], **change}) if change else "")
    before = (output / "result.csv").read_bytes()
    if recover(output) != 0:
        assert len(capsys.readouterr().err.splitlines()) == 1
        assert (output / ".unfinished" / f"{ROWS_FILE}.{ROWS}").stat().st_size == ROWS * SIZE
        assert (output / "result.csv").read_bytes() == before


@pytest.mark.parametrize("left", [0, 2])
def test_too_few_rows_do_not_replace_the_csv_file(output, left, capsys):
    os.truncate(output / ".unfinished" / f"{ROWS_FILE}.{ROWS}", left * SIZE)
    assert recover(output) == 2
    assert f"only {left} of {ROWS} rows" in capsys.readouterr().err
    assert len(cosim.Result.from_csv(output / "result.csv").time) == 3


def test_the_rows_that_are_left_are_written_if_there_is_no_csv_file(output, capsys):
    os.truncate(output / ".unfinished" / f"{ROWS_FILE}.{ROWS}", 2 * SIZE)
    (output / "result.csv").unlink()
    assert recover(output) == 0
    assert capsys.readouterr().out.startswith(f"2 of {ROWS} rows until t = 0.01 s")
