"""Text format of recordings as CSV, common to the final file and the one that is written during a run, and its reader."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from pathlib import Path

from .errors import InputError, Problem
from .paths import open_text
from .text import MAX_TEXT_LENGTH

#: size of a number in a CSV file (bytes), approximately
BYTES_PER_NUMBER = 20
#: first characters of a text that spreadsheet programs take for a formula
_FORMULA_STARTS = ("=", "+", "-", "@")
_excel_safe = False


def set_excel_safe(enabled: bool) -> None:
    """Set whether CSV files of this process are safe for spreadsheet programs (see `text_cell`)."""
    global _excel_safe
    _excel_safe = enabled


def text_cell(text: str) -> str:
    """Return a text for a cell; with `set_excel_safe`, an apostrophe precedes texts that would be formulas."""
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
    csv.field_size_limit(max(csv.field_size_limit(), MAX_TEXT_LENGTH))
    try:
        with open_text(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            rows = list(reader)
    except csv.Error as error:
        raise InputError(Problem(f"cannot read the row: {error}", f"{path}:{reader.line_num}")) from None
    except UnicodeDecodeError as error:
        raise InputError(f"cannot read {path}: it is not UTF-8 text: {error.reason} at byte {error.start}") from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from error
    if not rows:
        raise InputError(Problem("the file is empty, expected a header", str(path)))
    return rows[0], rows[1:]
