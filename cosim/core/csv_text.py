"""Text format of recordings as CSV, common to the final file and the one that is written during a run."""

from __future__ import annotations

from collections.abc import Iterable

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
    """Return a text as a quoted cell."""
    return '"' + text_cell(str(text)).replace('"', '""') + '"'


def format_header(signals: Iterable[str]) -> str:
    """Return the first line, with its newline: `time` and the names of the signals."""
    return ",".join(map(quote_cell, ("time", *signals))) + "\n"
