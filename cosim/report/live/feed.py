"""Rows of a running simulation as 32-bit floats for the live page."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path

import numpy as np

from ...process.run_files.folder import ROWS_FILE, RowsHeader

#: largest number of values of all signals together in a live page; longer runs are downsampled
MAX_VALUES = 4_000_000


class RowFeed:
    """Reader of the numeric signals of a running simulation.

    Used by the request threads of the supervising process.

    Args:
        folder: The folder with the files of the run.
        header: The description of its rows.
        expected_rows: The number of rows of the complete run. Only every `stride`-th row is read if
            there are many.
    """

    def __init__(self, folder: Path, header: RowsHeader, expected_rows: int):
        self._header, self._dtype = header, header.dtype
        self._path = folder / ROWS_FILE
        self._file = self._path.open("rb")  # stays readable after the run has removed the file
        self.columns = ["time", *(column.name for column in header.columns)]
        self.stride = max(1, -(-expected_rows * len(self.columns) // MAX_VALUES))
        #: number of rows of the complete run after downsampling
        self.capacity = (expected_rows - 1) // self.stride + 1

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal, "" if unknown."""
        return {column.name: column.unit for column in self._header.columns}

    def available(self, recorded: int) -> int:
        """Return the number of rows after downsampling when `recorded` rows have been recorded."""
        return (recorded - 1) // self.stride + 1 if recorded else 0

    def read(self, first: int, count: int) -> bytes:
        """Return the bytes of `count` rows from `first` on, column by column.

        Float32, shape (columns, count).
        """
        numbers = range(first * self.stride, (first + count) * self.stride, self.stride)
        table = np.empty((len(self.columns), count), "<f4")
        table[0] = [self._header.time_at(row * self._header.steps_per_row) for row in numbers]
        if count and self._dtype.itemsize:
            rows = self._rows(numbers)
            with np.errstate(over="ignore"):  # beyond float32 a value is shown as infinite
                for column, name in enumerate(self.columns[1:], start=1):
                    table[column] = rows[name]
        return table.tobytes()

    def _rows(self, numbers: range) -> np.ndarray:
        """Map rows into memory, because threads that read at the same time cannot share one file position."""
        size = self._dtype.itemsize
        mapped = np.memmap(
            self._file, self._dtype, "r", numbers.start * size, (numbers[-1] - numbers.start + 1,)
        )
        return mapped[:: self.stride]

    def close(self) -> None:
        """Close the file of the rows."""
        self._file.close()
