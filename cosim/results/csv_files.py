"""CSV files of recordings.

First column `time`, quoted names, no row of units, Booleans as 0 and 1, exact numbers.
"""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from contextlib import suppress
from io import StringIO
from itertools import islice, pairwise
from pathlib import Path

import numpy as np
import pydantic_core

from ..core.errors import InputError, Problem
from ..core.paths import open_text
from ..core.recording import Recording
from ..core.text import MAX_TEXT_LENGTH
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

    Booleans are 0 and 1. `pydantic_core` finds the shortest exact digits three times faster than
    `repr`.
    """
    values = [
        (column.astype(np.uint8) if column.dtype == bool else column).tolist() for column in columns
    ]
    rows = list(zip(*values, strict=True))
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
    texts = [str(cell) for cell in cells]
    has_underscores = any("_" in text for text in texts)  # NumPy reads "1_0" as 10
    for kind in (np.int64, np.uint64, np.float64) if not has_underscores else ():
        with suppress(ValueError, OverflowError):
            return np.array(texts, dtype=kind)
    return np.array(texts, dtype=object)


#: size of a number in a CSV file (bytes), approximately
BYTES_PER_NUMBER = 20
#: first characters of a text that spreadsheet programs take for a formula
_FORMULA_STARTS = ("=", "+", "-", "@")
#: characters of rows of numbers
_NUMBER_CHARACTERS = b"0123456789-+.eE,\nNaInfity"
#: integer -0, which JSON reads without its sign
_NEGATIVE_ZERO = re.compile(rb"-0(?![0-9.eE])")
_excel_safe = False


def set_excel_safe(enabled: bool) -> None:
    """Set whether CSV files of this process are safe for spreadsheet programs (see `text_cell`)."""
    global _excel_safe
    _excel_safe = enabled


def text_cell(text: str) -> str:
    """Return a text for a cell.

    With `set_excel_safe`, an apostrophe precedes texts that would be formulas.
    """
    return f"'{text}" if _excel_safe and text.startswith(_FORMULA_STARTS) else text


def quote_cell(text: object) -> str:
    """Return a text, or bytes as hexadecimal digits, as a quoted cell."""
    text = text.hex() if isinstance(text, bytes) else str(text)
    return '"' + text_cell(text).replace('"', '""') + '"'


def format_header(signals: Iterable[str]) -> str:
    """Return the first line, with its newline: `time` and the names of the signals."""
    return ",".join(map(quote_cell, ("time", *signals))) + "\n"


def read_rows(path: Path) -> tuple[list[str], list[list[str]]]:
    """Read a CSV file in UTF-8.

    Args:
        path: The file.

    Returns:
        The header, and the rows below it.

    Raises:
        InputError: The file cannot be read, is empty, or has a cell above `MAX_TEXT_LENGTH`.
    """
    return parse_rows(path, read_text(path))


def read_text(path: Path) -> str:
    """Return the text of a CSV file in UTF-8.

    Raises:
        InputError: The file cannot be read.
    """
    try:
        with open_text(path, encoding="utf-8-sig", newline="") as file:
            return file.read()
    except UnicodeDecodeError as error:
        raise InputError(
            f"cannot read {path}: it is not UTF-8 text: {error.reason} at byte {error.start}"
        ) from None
    except (OSError, ValueError) as error:
        raise InputError(
            f"cannot read {path}: {getattr(error, 'strerror', None) or error}"
        ) from error


def parse_rows(path: Path, text: str) -> tuple[list[str], list[list[str]]]:
    """Return the header of a CSV file and the rows below it, from the text of the file.

    Raises:
        InputError: The text is empty, or has a cell above `MAX_TEXT_LENGTH`.
    """
    csv.field_size_limit(max(csv.field_size_limit(), MAX_TEXT_LENGTH))
    reader = csv.reader(StringIO(text, newline=""), skipinitialspace=True)
    try:
        rows = list(reader)
    except csv.Error as error:
        raise InputError(
            Problem(f"cannot read the row: {error}", f"{path}:{reader.line_num}")
        ) from None
    if not rows:
        raise InputError(Problem("the file is empty, expected a header", str(path)))
    return rows[0], rows[1:]


def parse_number_rows(text: str) -> tuple[list[str], list[list[float]]] | None:
    """Return header and rows of numbers of a CSV text as cosim writes it; None for any other text.

    Rows of numbers are JSON arrays without brackets. `pydantic_core` parses these in 0.4 of the
    time of `csv` and NumPy.
    """
    header, _, body = text.partition("\n")
    data = body.encode()
    if (
        not header
        or header.count('"') % 2
        or data.translate(None, _NUMBER_CHARACTERS)
        or _NEGATIVE_ZERO.search(data)
    ):
        return None
    try:
        rows = pydantic_core.from_json(
            b"[[" + data.removesuffix(b"\n").replace(b"\n", b"],[") + b"]]"
        )
        return next(csv.reader([header], skipinitialspace=True)), rows
    except (ValueError, csv.Error, StopIteration):
        return None
