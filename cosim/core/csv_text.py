"""Text format of recordings as CSV, common to the final file and the one that is written during a run, and its reader."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from io import StringIO
from pathlib import Path

import pydantic_core

from .errors import InputError, Problem
from .paths import open_text
from .text import MAX_TEXT_LENGTH

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
    reader = csv.reader(StringIO(text, newline=""))
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
        return next(csv.reader([header])), rows
    except (ValueError, csv.Error, StopIteration):
        return None
