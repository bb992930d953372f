"""A run's rows as CSV while it goes on, so that even the loss of both processes leaves a readable file.

Whole lines are appended several times per second. The final file replaces it.
"""

from __future__ import annotations

import struct
import time
from pathlib import Path

from .journal import ROWS, Journal, Phase
from .unfinished import ROWS_FILE, Header, read_header

#: short runs are left alone for this long, long ones get new lines this often (s)
FIRST, EVERY = 0.7, 0.4

_ROWS_AT_A_TIME = 2000


class LiveCsv:
    """Appends to the journal's CSV file what was recorded since the last update; needs nothing but the standard library."""

    def __init__(self, journal: Journal):
        self._journal = journal
        self._folder, self._target = Path(), Path()
        self._header: Header | None = None
        self._written, self._next = 0, 0.0

    def update(self) -> None:
        """Append what is new, if it is time; a file that cannot be written is the business of the run itself."""
        now = time.monotonic()
        if self._journal.phase != Phase.STEPPING or now < self._next:
            return
        if self._header is None and not self._begin(now):
            return
        self._next = now + EVERY
        try:
            self._append(min(self._journal[ROWS], self._written + 100 * _ROWS_AT_A_TIME))
        except OSError:
            self._next = float("inf")

    def _begin(self, now: float) -> bool:
        if self._next == 0.0:
            self._next = now + FIRST
            return False
        folder, target = self._journal.folder, self._journal.csv
        if folder is None or target is None:
            return False
        self._header, self._folder, self._target = read_header(folder), folder, target
        return self._header is not None

    def _append(self, rows: int) -> None:
        header = self._header
        assert header is not None
        places = sorted({column.offset for column in header.columns})
        order = [places.index(column.offset) for column in header.columns]
        unpack = struct.Struct(_format(header)).iter_unpack
        with (self._folder / ROWS_FILE).open("rb") as source, self._target.open("a" if self._written else "w") as target:
            if not self._written:
                names = ("time", *(column.name.replace('"', '""') for column in header.columns))
                target.write(",".join(f'"{name}"' for name in names) + "\n")
            source.seek(self._written * header.row_size)
            while self._written < rows:
                count = min(rows - self._written, _ROWS_AT_A_TIME)
                lines = []
                for row, values in enumerate(unpack(source.read(count * header.row_size)), start=self._written):
                    cells = [values[i] for i in order]
                    texts = (repr(int(cell) if isinstance(cell, bool) else cell) for cell in cells)
                    lines.append(",".join((repr(header.seconds(row * header.every)), *texts)) + "\n")
                target.writelines(lines)
                target.flush()
                self._written += count


def _format(header: Header) -> str:
    """The row as a format of the struct module, columns by position."""
    parts, position = ["="], 0
    for offset, kind in sorted({(column.offset, struct_kind(column.dtype)) for column in header.columns}):
        parts += [f"{offset - position}x", kind]
        position = offset + struct.calcsize(f"={kind}")
    return "".join([*parts, f"{header.row_size - position}x"])


def struct_kind(dtype: str) -> str:
    """The struct module's character for a numpy dtype such as "<f8".

    >>> struct_kind("<f8"), struct_kind("|b1"), struct_kind("<u4")
    ('d', '?', 'I')
    """
    kind, size = dtype[1], int(dtype[2:])
    if kind == "f":
        return {4: "f", 8: "d"}[size]
    if kind == "b":
        return "?"
    signed = {1: "b", 2: "h", 4: "i", 8: "q"}[size]
    return signed if kind == "i" else signed.upper()
