"""A run's rows as CSV while it goes on, so that even the loss of both processes leaves a readable file.

The file the user sees is whole at every moment: new lines are appended to a second copy, which then takes its place in one
step. So the copies take turns. The final file replaces it.
"""

from __future__ import annotations

import os
import struct
import time
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from shutil import copyfileobj
from typing import IO

from ..journal import ROWS, Journal
from .folder import ROWS_FILE, Header, TextReader, read_header

#: short runs are left alone for this long, long ones get new lines this often, and no longer than this at a time (s)
FIRST, EVERY, AT_MOST = 0.2, 0.3, 0.2

_ROWS_AT_A_TIME = 500


@dataclass
class _Copy:
    """A file, and how much of it is sound (bytes)."""

    path: Path
    size: int = 0


class LiveCsv:
    """Appends to the journal's CSV file what was recorded since the last update; without NumPy, which is slow to import."""

    def __init__(self, journal: Journal):
        self._journal = journal
        self._next = 0.0
        self._lines: Lines | None = None

    def update(self) -> None:
        """Append what is new, if it is time; a file that cannot be written is the business of the run itself."""
        now = time.monotonic()
        if not self._journal.phase.in_loop or now < self._next:
            return
        try:
            if self._lines is None and not self._begin(now):
                return
            self._append(now + AT_MOST)
        except OSError:
            self._next = float("inf")

    def _begin(self, now: float) -> bool:
        if self._next == 0.0:
            self._next = now + FIRST
            return False
        folder, target = self._journal.folder, self._journal.csv
        header = read_header(folder)
        if folder is None or target is None or header is None:
            return False
        self._target, self._rows_file = target, folder / ROWS_FILE
        self._lines = Lines(header, TextReader(folder, header))
        self._shown, self._hidden = (_Copy(folder / f"live-{name}.csv") for name in "ab")
        self._shown.path.write_bytes(self._lines.first())
        self._shown.size = len(self._lines.first())
        self._hidden.path.touch()
        return True

    def _append(self, until: float) -> None:
        """Bring the hidden copy up to date, as far as time allows, and show it."""
        assert self._lines is not None
        written, rows = self._lines.written, self._journal[ROWS]
        try:
            with self._hidden.path.open("r+b") as target:
                self._catch_up(target)
                with self._rows_file.open("rb") as source:
                    while self._lines.written < rows and time.monotonic() < until:
                        target.write(self._lines.next(source, rows))
                self._hidden.size = target.tell()
            shown = self._show()
        except BaseException:
            self._lines.written = written
            raise
        if shown:
            self._shown, self._hidden = self._hidden, self._shown
        self._next = time.monotonic() + (EVERY if self._lines.written == rows else 0)

    def _catch_up(self, target: IO[bytes]) -> None:
        """What the shown copy has and the hidden one lacks; an append that was interrupted is undone."""
        size = min(self._hidden.size, self._shown.size)
        target.truncate(size)
        target.seek(size)
        with self._shown.path.open("rb") as shown:
            shown.seek(size)
            copyfileobj(shown, target)

    def _show(self) -> bool:
        """Put the hidden copy in its place, unless the run has left the stepping loop: then the final file is on its way."""
        link = self._hidden.path.with_suffix(".link")
        link.unlink(missing_ok=True)
        os.link(self._hidden.path, link)
        with self._journal.showing() as allowed:
            if allowed:
                link.replace(self._target)
        return allowed


class Lines:
    """The rows of a run as lines of CSV, in the format of `results.csv_files`."""

    def __init__(self, header: Header, texts: TextReader):
        self._header, self._texts = header, texts
        places = sorted({column.offset for column in header.columns})
        order = [places.index(column.offset) for column in header.columns]
        self._ordered = itemgetter(*order) if len(order) > 1 else lambda values: tuple(values[i] for i in order)
        self._unpack = struct.Struct(_format(header)).iter_unpack
        #: rows that were given out
        self.written = 0

    def first(self) -> bytes:
        """The line of names."""
        return ",".join(map(_quoted, ("time", *self._header.names))).encode() + b"\n"

    def next(self, source: IO[bytes], rows: int) -> bytes:
        """Lines of some of the rows that follow, of `rows` that there are in the file."""
        from pydantic_core import to_json

        header, first = self._header, self.written
        count = min(rows - first, _ROWS_AT_A_TIME)
        source.seek(first * header.row_size)
        data = source.read(count * header.row_size)
        if len(data) < count * header.row_size:
            raise OSError("rows are missing: foreign code has made their file shorter")
        values = self._unpack(data) if header.row_size else [()] * count
        table = [(header.seconds(n * header.every), *self._ordered(row)) for n, row in enumerate(values, start=first)]
        lines = to_json(table, inf_nan_mode="constants")[2:-2].replace(b"],[", b"\n") + b"\n"
        self.written += len(table)
        return self._with_texts(lines, first) if header.texts else lines

    def _with_texts(self, lines: bytes, first: int) -> bytes:
        """The lines of numbers, the first of them with this number, with texts between them."""
        whole = []
        for row, line in enumerate(lines.decode().splitlines(), start=first):
            time, *numbers = line.split(",")
            whole.append(",".join([time, *self._header.complete(numbers, map(_quoted, self._texts.row(row)))]) + "\n")
        return "".join(whole).encode()


def _quoted(text: str) -> str:
    return '"' + str(text).replace('"', '""') + '"'


def _format(header: Header) -> str:
    """The row as a format of the struct module, columns by position."""
    parts, position = ["="], 0
    for offset, kind in sorted({(column.offset, struct_kind(column.dtype)) for column in header.columns}):
        parts += [f"{offset - position}x", kind]
        position = offset + struct.calcsize(f"={kind}")
    return "".join([*parts, f"{header.row_size - position}x"])


def struct_kind(dtype: str) -> str:
    """The struct module's character for a numpy dtype such as "<f8"; Booleans are 0 and 1.

    >>> struct_kind("<f8"), struct_kind("|b1"), struct_kind("<u4")
    ('d', 'B', 'I')
    """
    kind, size = dtype[1], int(dtype[2:])
    if kind == "f":
        return {4: "f", 8: "d"}[size]
    if kind == "b":
        return "B"
    signed = {1: "b", 2: "h", 4: "i", 8: "q"}[size]
    return signed if kind == "i" else signed.upper()
