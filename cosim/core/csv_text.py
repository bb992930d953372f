"""Text format of recordings as CSV, common to the final file and the one that is written during a run."""

from __future__ import annotations

from collections.abc import Iterable

#: size of a number in a CSV file (bytes), approximately
BYTES_PER_NUMBER = 20


def quote_cell(text: object) -> str:
    """Return a text as a quoted cell."""
    return '"' + str(text).replace('"', '""') + '"'


def format_header(signals: Iterable[str]) -> str:
    """Return the first line, with its newline: `time` and the names of the signals."""
    return ",".join(map(quote_cell, ("time", *signals))) + "\n"
