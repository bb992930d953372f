"""Files of an unfinished run: layout, rows, string signals."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from cosim.process.run_files import (
    HEADER_FILE,
    ROWS_FILE,
    SIGNALS,
    TEXTS_FILE,
    TIME,
    Column,
    RowLayout,
    RowsFile,
    keep_rows,
    recover_recording,
)

ROWS_COUNT = 1234
CALLS = [("a", "fmi2DoStep")]
KINDS = {
    "a.x": "<f8",
    'quoted "b"': "<f4",
    "flag": "|b1",
    "small": "|i1",
    "natural": "<u8",
    "whole": "<i8",
}
OFFSETS = [0, 8, 12, 13, 24, 32]

#: from these rows on the two texts are others
TEXTS = {
    0: {"first": "a"},
    7: {"last": 'quoted, "x"'},
    600: {"first": "", "last": "\N{SNOWMAN}\n"},
    1200: {"last": "end"},
}


def layout() -> RowLayout:
    """Return a layout with gaps; one signal is recorded under two names."""
    columns = [Column("twin", "<i8", OFFSETS[-1], False, "")]
    for (name, kind), offset in zip(KINDS.items(), OFFSETS, strict=True):
        columns.append(Column(name, kind, offset, kind == "|b1", "m"))
    return RowLayout(48, columns, [(0, "first"), (len(columns) + 1, "last")])


@pytest.fixture
def table() -> np.ndarray:
    """Random bits in all types, with gaps between some fields and non-finite numbers."""
    dtype = layout().dtype
    bits = np.random.default_rng(5).integers(0, 256, ROWS_COUNT * dtype.itemsize, dtype=np.uint8)
    rows = bits.view(dtype)
    rows[TIME] = np.arange(ROWS_COUNT) / 3
    signals = rows[SIGNALS]
    signals["flag"] = signals["small"] > 0
    signals["a.x"][:3] = np.nan, np.inf, -np.inf
    return rows


def write(table: np.ndarray, folder: Path) -> RowsFile:
    (folder / ROWS_FILE).write_bytes(table.tobytes())
    file = RowsFile(folder, layout())
    for row, texts in TEXTS.items():
        file.write_texts(row, texts)
    file.write_header(CALLS)
    return file


def expected_texts(rows: int) -> dict[str, np.ndarray]:
    columns = {name: np.full(rows, "", object) for name in ("first", "last")}
    for row, changes in TEXTS.items():
        for name, text in changes.items():
            columns[name][row:] = text
    return columns


@pytest.mark.parametrize("rows", [0, 1, 601, ROWS_COUNT, ROWS_COUNT + 1])
def test_another_process_reads_what_was_written(table, tmp_path, rows):
    write(table, tmp_path)
    opened = RowsFile.open(tmp_path)
    assert opened.layout.calls == CALLS
    assert opened.count_rows() == ROWS_COUNT
    recording, count = opened.recording(rows), min(rows, ROWS_COUNT)
    assert list(recording.columns) == ["first", "twin", *KINDS, "last"]
    assert recording.units == {"first": "", "twin": "", **dict.fromkeys(KINDS, "m"), "last": ""}
    assert recording.time.tolist() == [n / 3 for n in range(count)]
    assert recording.columns["flag"].dtype == bool
    signals = table[SIGNALS][:count]
    for name in KINDS:
        assert recording.columns[name].tobytes() == signals[name].tobytes()
    assert recording.columns["twin"].tobytes() == signals["whole"].tobytes()
    for name, column in expected_texts(count).items():
        assert recording.columns[name].tolist() == column.tolist()


@pytest.mark.parametrize("complete", [0, 1, 2, 700])
def test_the_rows_of_a_killed_process_are_counted(table, tmp_path, complete):
    """The time of a row is written last, and the rest of a chunk contains zeros."""
    table[complete + 1 :] = np.zeros((), table.dtype)
    table[TIME][complete:] = 0
    write(table, tmp_path)
    assert RowsFile.open(tmp_path).count_rows() == max(1, complete)


def test_kept_rows_have_their_number_in_their_name(table, tmp_path):
    write(table, tmp_path)
    keep_rows(tmp_path, 700, {})
    assert (tmp_path / f"{ROWS_FILE}.700").stat().st_size == 700 * table.itemsize
    assert RowsFile.open(tmp_path).kept_rows == 700
    assert len(recover_recording(tmp_path, 5).time) == 700


def test_a_truncated_file_has_fewer_rows(table, tmp_path):
    file = write(table, tmp_path)
    os.truncate(file.path, 10 * table.itemsize + 3)
    assert len(recover_recording(tmp_path, ROWS_COUNT).time) == 10


def test_an_incomplete_change_of_strings_is_left_out(table, tmp_path):
    rows_file, file = write(table, tmp_path), tmp_path / TEXTS_FILE
    file.write_bytes(file.read_bytes()[:-3])
    assert [column[-1] for column in rows_file.read_texts(ROWS_COUNT)] == ["", "\N{SNOWMAN}\n"]


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
    rows_file = write(table, tmp_path)
    first, *others = (tmp_path / TEXTS_FILE).read_bytes().splitlines(keepends=True)
    (tmp_path / TEXTS_FILE).write_bytes(b"".join([first, line, b"\n", *others]))
    for name, column in zip(("first", "last"), rows_file.read_texts(ROWS_COUNT), strict=True):
        assert column.tolist() == expected_texts(ROWS_COUNT)[name].tolist()


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
    assert RowsFile.open(tmp_path) is None
    assert len(recover_recording(tmp_path, 10).time) == 0
