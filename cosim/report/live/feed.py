"""Rows of a running simulation as 32-bit floats for the live page."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from ...process.row_store import map_rows
from ...process.run_files import SIGNALS, TIME, RowsFile

#: largest number of values of all signals together in a live page; longer runs are downsampled
MAX_VALUES = 4_000_000


class RowFeed:
    """Reader of the numeric signals of a running simulation.

    Used by the request threads of the supervising process.

    Args:
        rows_file: The rows of the run.
        expected_rows: The number of rows of the complete run. Only every `stride`-th row is read if
            there are many.
    """

    def __init__(self, rows_file: RowsFile, expected_rows: int):
        self._layout, self._dtype = rows_file.layout, rows_file.layout.dtype
        self._file = rows_file.path.open("rb")  # stays readable after the run has removed the file
        self.columns = ["time", *(column.name for column in self._layout.columns)]
        self.stride = max(1, -(-expected_rows * len(self.columns) // MAX_VALUES))
        #: number of rows of the complete run after downsampling
        self.capacity = (expected_rows - 1) // self.stride + 1

    @cached_property
    def units(self) -> Mapping[str, str]:
        """Unit of each signal, "" if unknown."""
        return {column.name: column.unit for column in self._layout.columns}

    def available(self, recorded: int) -> int:
        """Return the number of rows after downsampling when `recorded` rows have been recorded.

        Rows between communication points are not in `capacity`; the page then shows fewer of the
        last rows while the run goes on.
        """
        return min(self.capacity, (recorded - 1) // self.stride + 1) if recorded else 0

    def read(self, first: int, count: int) -> bytes:
        """Return the bytes of `count` rows from `first` on, column by column.

        Float32, shape (columns, count).
        """
        table = np.empty((len(self.columns), count), "<f4")
        span = max(0, (count - 1) * self.stride + 1)
        # not read from the file, because threads that read at the same time share its position
        rows = map_rows(self._file, self._dtype, first * self.stride, span)[:: self.stride]
        table[0] = rows[TIME]
        with np.errstate(over="ignore"):  # beyond float32 a value is shown as infinite
            for column, name in enumerate(self.columns[1:], start=1):
                table[column] = rows[SIGNALS][name]
        return table.tobytes()

    def close(self) -> None:
        """Close the file of the rows."""
        self._file.close()
