"""Rows of a run that is going on, for a page: 32-bit floats, as they come."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from ...process.run_files.folder import ROWS_FILE, RowsHeader

#: values of all signals together that a page can hold while they come; longer runs are thinned
MAX_VALUES = 4_000_000


class RowFeed:
    """The numeric signals of a run of `expected` rows, whose files lie in `folder`; every `stride`-th row is given out."""

    def __init__(self, folder: Path, header: RowsHeader, expected_rows: int):
        self._header, self._dtype = header, header.dtype
        self._path = folder / ROWS_FILE
        self._file = self._path.open("rb")  # it may be removed while somebody still reads
        self.columns = ["time", *(column.name for column in header.columns)]
        self.stride = max(1, -(-expected_rows * len(self.columns) // MAX_VALUES))
        #: so many rows will be given out at most
        self.capacity = (expected_rows - 1) // self.stride + 1

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal, "" where it is unknown."""
        return {column.name: column.unit for column in self._header.columns}

    def available(self, recorded: int) -> int:
        """Rows to give out, when so many were recorded."""
        return (recorded - 1) // self.stride + 1 if recorded else 0

    def read(self, first: int, count: int) -> bytes:
        """Rows from `first` on, column by column: float32 of shape (columns, count)."""
        numbers = range(first * self.stride, (first + count) * self.stride, self.stride)
        table = np.empty((len(self.columns), count), "<f4")
        table[0] = [self._header.time_at(row * self._header.steps_per_row) for row in numbers]
        if count and self._dtype.itemsize:
            rows = self._rows(numbers)
            for place, name in enumerate(self.columns[1:], start=1):
                table[place] = rows[name]
        return table.tobytes()

    def _rows(self, numbers: range) -> np.ndarray:
        """Without a cursor that is shared: several pages may read at the same time."""
        size = self._dtype.itemsize
        mapped = np.memmap(self._file, self._dtype, "r", numbers.start * size, (numbers[-1] - numbers.start + 1,))
        return mapped[:: self.stride]

    def close(self) -> None:
        self._file.close()
