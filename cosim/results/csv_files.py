"""CSV files of recordings.

First column `time`, quoted names, no row of units, Booleans as 0 and 1, exact numbers.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
import pydantic_core

from ..core.csv_text import format_header, parse_number_rows, parse_rows, quote_cell, read_text
from ..core.errors import InputError, Problem
from ..core.recording import Recording
from .files import iterate_chunks, writing_atomically

#: rows that are formatted at a time: few enough for the cache of the processor, which makes it 1.6
#: times as fast
ROWS_PER_CHUNK = 200


def write_csv(recording: Recording, path: str | Path) -> None:
    """Write a recording; an existing file is replaced only when the new one is complete.

    Args:
        recording: The recording.
        path: The CSV file; missing folders are created.

    Raises:
        InputError: The path cannot be written.
        OutputError: The disk is full or defective.
    """
    columns = [recording.time, *recording.columns.values()]
    format_rows = (
        _format_texts if any(column.dtype == object for column in columns) else _format_numbers
    )
    with writing_atomically(path) as temporary, temporary.open("wb") as file:
        file.write(format_header(recording.columns).encode())
        for piece in iterate_chunks(columns, ROWS_PER_CHUNK):
            file.write(format_rows([column[piece] for column in columns]))


def _format_numbers(columns: Sequence[np.ndarray]) -> bytes:
    """Return the lines of rows of numbers.

    `pydantic_core` finds the shortest exact digits three times faster than `repr`.
    """
    rows = list(zip(*map(_to_numbers, columns), strict=True))
    return (
        pydantic_core.to_json(rows, inf_nan_mode="constants")[2:-2].replace(b"],[", b"\n") + b"\n"
    )


def _format_texts(columns: Sequence[np.ndarray]) -> bytes:
    """Return the lines of rows with texts."""
    cells = [
        map(quote_cell, column)
        if column.dtype == object
        else _format_numbers([column]).decode().splitlines()
        for column in columns
    ]
    return "".join(",".join(row) + "\n" for row in zip(*cells, strict=True)).encode()


def _to_numbers(column: np.ndarray) -> list[float]:
    """Return the values of a column; Booleans as 0 and 1."""
    numbers: list[float] = (column.astype(np.uint8) if column.dtype == bool else column).tolist()
    return numbers


def read_csv(path: str | Path) -> Recording:
    """Read a recording, also of another program, if the first column is named `time`.

    Args:
        path: The CSV file.

    Returns:
        A recording without units. A column of integers has the type int64 or uint64, another column
        of numbers float64, any other column object (strings). Booleans are returned as 0 and 1.

    Raises:
        InputError: The file cannot be read, with the line of each problem.
    """
    path = Path(path)
    text = read_text(path)
    table: tuple[list[str], Sequence[Sequence[float] | Sequence[str]]] = parse_number_rows(
        text
    ) or parse_rows(path, text)
    header, rows = table[0], [row for row in table[1] if row]
    _check_table(path, *table)
    time, *columns = (
        map(_to_column, zip(*rows, strict=True)) if rows else [np.empty(0)] * len(header)
    )
    recording = Recording(
        time, dict(zip(header[1:], columns, strict=True)), dict.fromkeys(header[1:], "")
    )
    return _convert_time(path, recording)


def _check_table(path: Path, header: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    problems = []
    if header[:1] != ["time"]:
        problems.append(
            Problem(f'the first column is "{"".join(header[:1])}", expected "time"', f"{path}:1")
        )
    repeated = [name for name, count in Counter(header).items() if count > 1]
    problems += [
        Problem(f'column "{name}" occurs more than once', f"{path}:1") for name in repeated
    ]
    ragged = (
        (line, len(row))
        for line, row in enumerate(rows, start=2)
        if row and len(row) != len(header)
    )
    for line, length in islice(ragged, 1):
        problems.append(
            Problem(f"{length} cells, expected {len(header)} as in the header", f"{path}:{line}")
        )
    if problems:
        raise InputError(problems)


def _to_column(cells: Sequence[float] | Sequence[str]) -> np.ndarray:
    """Return the array of the texts or numbers of a column."""
    types = set(map(type, cells))
    if str not in types:
        with suppress(OverflowError):
            return np.array(cells, dtype=np.int64 if types == {int} else np.float64)
    return _parse_column([str(cell) for cell in cells])


def _parse_column(cells: Sequence[str]) -> np.ndarray:
    has_underscores = any("_" in cell for cell in cells)  # NumPy reads "1_0" as 10
    for kind in (np.int64, np.uint64, np.float64) if not has_underscores else ():
        try:
            return np.array(cells, dtype=kind)
        except (ValueError, OverflowError):
            continue
    return np.array(cells, dtype=object)


def _convert_time(path: Path, recording: Recording) -> Recording:
    try:
        time = recording.time.astype(np.float64)
    except ValueError as error:
        raise InputError(Problem(f"the column time: {error}", str(path))) from None
    if not np.isfinite(time).all():
        raise InputError(Problem("the column time holds values that are not finite", str(path)))
    if back := next((pair for pair in pairwise(time) if pair[1] < pair[0]), None):
        raise InputError(
            Problem(f"time goes back from {back[0]:.12g} s to {back[1]:.12g} s", str(path))
        )
    return Recording(time, recording.columns, recording.units)
