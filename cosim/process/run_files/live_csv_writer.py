"""CSV file of a run in progress, which remains readable even if both processes are killed.

The result file is complete at any time: new lines are appended to one of two copies, which then
replaces it atomically; the next update uses the other copy. The final file replaces it at the end
of the run.
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

from ...core.csv_text import format_header, quote_cell
from ..journal import ROW_COUNT, Journal
from .folder import LIVE_COPY_PREFIX, ROWS_FILE, RowsHeader, TextReader, read_header

#: time until the first update, time between updates, maximum duration of an update (s)
FIRST_UPDATE_DELAY, UPDATE_INTERVAL, MAX_UPDATE_TIME = 0.2, 0.3, 0.2

_ROWS_PER_CHUNK = 500


@dataclass
class _CsvCopy:
    """A file and its valid size (bytes)."""

    path: Path
    size: int = 0


class LiveCsvWriter:
    """Writer of the CSV file that the journal names; it avoids NumPy, which is slow to import."""

    def __init__(self, journal: Journal):
        self._journal = journal
        self._next_update = 0.0
        self._lines: CsvLineReader | None = None

    def update(self) -> None:
        """Append new rows if an update is due.

        Stop updating after a write error, which the run itself reports.
        """
        now = time.monotonic()
        if not self._journal.in_loop or now < self._next_update:
            return
        try:
            if self._lines is None and not self._open_copies(now):
                return
            self._append_rows(now + MAX_UPDATE_TIME)
        except OSError:
            self._next_update = float("inf")

    def _open_copies(self, now: float) -> bool:
        """Create both copies; return False if it is too early or the run has no header yet."""
        if self._next_update == 0.0:
            self._next_update = now + FIRST_UPDATE_DELAY
            return False
        folder, target = self._journal.folder, self._journal.csv_path
        header = read_header(folder)
        if folder is None or target is None or header is None:
            return False
        self._target, self._rows_file = target, folder / ROWS_FILE
        self._lines = CsvLineReader(header, TextReader(folder, header))
        self._front, self._back = (
            _CsvCopy(folder / f"{LIVE_COPY_PREFIX}{name}.csv") for name in "ab"
        )
        self._front.path.write_bytes(self._lines.header_line())
        self._front.size = len(self._lines.header_line())
        self._back.path.touch()
        return True

    def _append_rows(self, until: float) -> None:
        """Append rows to the back copy until the time `until` and publish it."""
        assert self._lines is not None
        former_count, rows = self._lines.row_count, self._journal[ROW_COUNT]
        try:
            with self._back.path.open("r+b") as target:
                self._synchronize_back(target)
                with self._rows_file.open("rb") as source:
                    while self._lines.row_count < rows and time.monotonic() < until:
                        target.write(self._lines.read_lines(source, rows))
                self._back.size = target.tell()
            published = self._publish_back()
        except BaseException:
            self._lines.row_count = former_count
            raise
        if published:
            self._front, self._back = self._back, self._front
        self._next_update = time.monotonic() + (
            UPDATE_INTERVAL if self._lines.row_count == rows else 0
        )

    def _synchronize_back(self, target: IO[bytes]) -> None:
        """Append the lines that only the front copy has to the back copy, and undo an interrupted append."""
        size = min(self._back.size, self._front.size)
        target.truncate(size)
        target.seek(size)
        with self._front.path.open("rb") as source:
            source.seek(size)
            copyfileobj(source, target)

    def _publish_back(self) -> bool:
        """Replace the result file by the back copy, unless the run has left the stepping loop and writes the final file."""
        link = self._back.path.with_suffix(".link")
        link.unlink(missing_ok=True)
        os.link(self._back.path, link)
        with self._journal.updating_csv() as allowed:
            if allowed:
                link.replace(self._target)
        return allowed


class CsvLineReader:
    """Converter of the rows of a run to lines of CSV, in the format of `results.csv_files`."""

    def __init__(self, header: RowsHeader, texts: TextReader):
        self._header, self._texts = header, texts
        offsets = sorted({column.offset for column in header.columns})
        order = [offsets.index(column.offset) for column in header.columns]
        self._order_columns = (
            itemgetter(*order) if len(order) > 1 else lambda values: tuple(values[i] for i in order)
        )
        self._unpack = struct.Struct(_row_format(header)).iter_unpack
        #: number of rows that were converted
        self.row_count = 0

    def header_line(self) -> bytes:
        """Return the line with the names of the columns."""
        return format_header(self._header.names).encode()

    def read_lines(self, source: IO[bytes], rows: int) -> bytes:
        """Convert the next rows, at most `_ROWS_PER_CHUNK`.

        Args:
            source: File of rows.
            rows: Number of rows in the file.

        Raises:
            OSError: The file is shorter than expected.
        """
        from pydantic_core import to_json

        header, first = self._header, self.row_count
        count = min(rows - first, _ROWS_PER_CHUNK)
        source.seek(first * header.row_size)
        data = source.read(count * header.row_size)
        if len(data) < count * header.row_size:
            raise OSError("rows are missing: foreign code has truncated their file")
        values = self._unpack(data) if header.row_size else [()] * count
        table = [
            (header.time_at(n * header.steps_per_row), *self._order_columns(row))
            for n, row in enumerate(values, start=first)
        ]
        lines = to_json(table, inf_nan_mode="constants")[2:-2].replace(b"],[", b"\n") + b"\n"
        self.row_count += len(table)
        return self._insert_texts(lines, first) if header.texts else lines

    def _insert_texts(self, lines: bytes, first: int) -> bytes:
        """Insert the string signals into lines of numbers.

        `first` is the number of the first row.
        """
        complete = []
        for row, line in enumerate(lines.decode().splitlines(), start=first):
            time, *numbers = line.split(",")
            complete.append(
                ",".join(
                    [
                        time,
                        *self._header.merge_columns(
                            numbers, map(quote_cell, self._texts.read_row(row))
                        ),
                    ]
                )
                + "\n"
            )
        return "".join(complete).encode()


def _row_format(header: RowsHeader) -> str:
    """Return the format of a row for the struct module, with columns in ascending order of their offsets."""
    parts, position = ["="], 0
    for offset, kind in sorted(
        {(column.offset, struct_format_character(column.dtype)) for column in header.columns}
    ):
        parts += [f"{offset - position}x", kind]
        position = offset + struct.calcsize(f"={kind}")
    return "".join([*parts, f"{header.row_size - position}x"])


def struct_format_character(dtype: str) -> str:
    """Return the format character of the struct module for a NumPy dtype.

    Booleans are unsigned bytes.

    >>> struct_format_character("<f8"), struct_format_character("|b1"), struct_format_character("<u4")
    ('d', 'B', 'I')
    """
    kind, size = dtype[1], int(dtype[2:])
    if kind == "f":
        return {4: "f", 8: "d"}[size]
    if kind == "b":
        return "B"
    signed = {1: "b", 2: "h", 4: "i", 8: "q"}[size]
    return signed if kind == "i" else signed.upper()
