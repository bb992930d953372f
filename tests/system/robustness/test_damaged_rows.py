"""`cosim recover` with damaged files: kept rows stay until their results are written."""

from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np
import pytest

import cosim
from cosim.cli import main
from cosim.process.run_files import HEADER_FILE, ROWS_FILE

ROWS, SIZE = 6, 16
HEADER = {"signals_size": 8, "calls": [], "texts": []}
COLUMN = {"name": "a.y", "dtype": "<f8", "offset": 0, "boolean": False, "unit": ""}


@pytest.fixture
def output(tmp_path: Path) -> Path:
    """An output directory with six rows that were kept."""
    folder = tmp_path / "out" / ".unfinished"
    folder.mkdir(parents=True)
    (folder / HEADER_FILE).write_text(json.dumps({**HEADER, "columns": [COLUMN]}))
    rows = np.column_stack([np.arange(ROWS) / 100, np.zeros(ROWS)])
    (folder / f"{ROWS_FILE}.{ROWS}").write_bytes(rows.tobytes())
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
        {"columns": []},
        {"signals_size": 0},
        {"signals_size": -8},
        {"columns": [{**COLUMN, "dtype": "x"}]},
        {"signals_size": []},
    ],
)
def test_a_damaged_header(output, change, capsys):
    header = output / ".unfinished" / HEADER_FILE
    header.write_text(json.dumps({**HEADER, "columns": [COLUMN], **change}) if change else "")
    if recover(output) != 0:
        assert len(capsys.readouterr().err.splitlines()) == 1
        assert (output / ".unfinished" / f"{ROWS_FILE}.{ROWS}").stat().st_size == ROWS * SIZE
        assert not (output / "result.csv").exists()


def test_rows_that_cannot_be_read_are_an_error(output, capsys):
    os.truncate(output / ".unfinished" / f"{ROWS_FILE}.{ROWS}", SIZE - 1)
    assert recover(output) == 2
    assert f"only 0 of {ROWS} rows" in capsys.readouterr().err
    assert not (output / "result.csv").exists()


def test_the_rows_that_are_left_are_written(output, capsys):
    os.truncate(output / ".unfinished" / f"{ROWS_FILE}.{ROWS}", 2 * SIZE)
    assert recover(output) == 0
    assert capsys.readouterr().out.startswith(f"2 of {ROWS} rows until t = 0.01 s")


def test_rows_of_a_killed_run_are_recovered(output, capsys):
    """Nobody has counted the rows, and the rest of their chunk contains zeros."""
    unfinished = output / ".unfinished"
    with (unfinished / f"{ROWS_FILE}.{ROWS}").open("ab") as file:
        file.write(bytes(5 * SIZE))
    (unfinished / f"{ROWS_FILE}.{ROWS}").rename(unfinished / ROWS_FILE)
    assert recover(output) == 0
    assert capsys.readouterr().out.startswith(f"{ROWS} rows until t = 0.05 s")
    assert json.loads((output / "run.json").read_text())["failure"] == "killed"
