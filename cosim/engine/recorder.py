"""Recording of outputs: one row of values per recorded communication point."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.recording import Recording
from ..process.run_files.row_store import compute_in_chunks, open_row_store
from .layout import ArrayPosition
from .plan import Plan
from .transfer_calls import MAX_SINGLE_COPIES

#: writes the current values into the row with this number
RowWriter = Callable[[int], object]


class RowPart(NamedTuple):
    """Values of one dtype in a row: `source[indices]`, written at byte offset `position`."""

    source: np.ndarray
    indices: np.ndarray
    position: int


class Recorder:
    """Stores the values of the recorded outputs at every `every`-th communication point.

    A row is a copy of the whole output buffer if at least half of it is recorded; otherwise it
    contains only the recorded values. Strings and binaries are stored in memory, apart from the
    rows.

    Args:
        plan: the compiled system.
        file: file for the rows; by default they are in memory, or in a temporary file if there are
            very many.
    """

    def __init__(self, plan: Plan, file: Path | None = None):
        self._plan, self.every = plan, plan.record_every
        columns = plan.settings.columns
        #: recorded name -> its variable
        self.variables = {
            name: plan.system.find_element(endpoint).variable for name, endpoint in columns.items()
        }
        self._positions = {
            name: plan.outputs.positions[endpoint] for name, endpoint in columns.items()
        }
        numeric = sorted(
            {p for p in self._positions.values() if not p.dtype.hasobject}, key=_alignment_order
        )
        #: a row is a copy of the whole output buffer
        self.whole_buffer = (
            2 * sum(position.dtype.itemsize for position in numeric)
            >= plan.outputs.buffer.nbytes
            > 0
        )
        #: the parts of a row otherwise
        self.row_parts: Sequence[RowPart] = (
            () if self.whole_buffer else list(self._pack_row(numeric))
        )
        self.row_store = open_row_store(self._row_dtype(numeric), plan.row_count, file)
        #: number of rows recorded so far
        self.row_count = 0
        self._string_columns = {
            name: _StringColumn(plan.outputs.arrays[position.dtype], position.offset)
            for name, position in self._positions.items()
            if position.dtype.hasobject
        }
        self._string_writers: list[RowWriter] = [
            column.append for column in self._string_columns.values()
        ]
        #: functions that write a row of the current chunk
        self.row_writers: Sequence[RowWriter] = ()
        #: number of rows that still fit into the current chunk, the bytes of the chunk, and the
        #: address of its end
        self.free_rows, self.chunk, self._chunk_end = 0, np.zeros(0, np.uint8), 0

    def _pack_row(self, numeric: Sequence[ArrayPosition]) -> Iterator[RowPart]:
        row_offset = 0
        for dtype, positions in groupby(numeric, lambda position: position.dtype):
            indices = np.array([position.offset for position in positions], np.intp)
            yield RowPart(self._plan.outputs.arrays[dtype], indices, row_offset)
            row_offset += len(indices) * dtype.itemsize

    def _row_dtype(self, numeric: Sequence[ArrayPosition]) -> np.dtype[Any]:
        """Return the structured dtype of a row: one field per recorded name.

        Names of the same output share their bytes.
        """
        outputs = self._plan.outputs
        ends = np.cumsum([0, *(position.dtype.itemsize for position in numeric)]).tolist()
        if self.whole_buffer:
            offsets, size = (
                {position: outputs.byte_offset(position) for position in numeric},
                outputs.buffer.nbytes,
            )
        else:
            offsets, size = dict(zip(numeric, ends, strict=False)), -(-ends[-1] // 8) * 8
        fields = {
            name: position
            for name, position in self._positions.items()
            if not position.dtype.hasobject
        }
        return np.dtype(
            {
                "names": list(fields),
                "formats": [position.dtype for position in fields.values()],
                "offsets": [offsets[position] for position in fields.values()],
                "itemsize": size,
            }
        )

    def write_header(self, call_names: Sequence[tuple[str, str]]) -> None:
        """Write a description of the rows for other processes.

        This recorder keeps its rows private and writes none.
        """

    def start_chunk(self) -> None:
        """Add a chunk to the row store; call it when the current chunk is full."""
        chunk = self.row_store.add_chunk()
        self.chunk = chunk.view(np.uint8) if chunk.dtype.itemsize else np.zeros(0, np.uint8)
        self._use_chunk()

    def _use_chunk(self) -> None:
        """Write the next rows to the current chunk, whose first row is the next one."""
        self.free_rows = self.row_store.chunk_rows
        self._chunk_end = self.chunk.ctypes.data + len(self.chunk)
        size, first = self.row_store.dtype.itemsize, self.row_count
        if self.whole_buffer:
            writers = [_buffer_writer(self.chunk.data, self._plan.outputs.buffer.data, size, first)]
        else:
            writers = [_part_writer(self.chunk, size, part, first) for part in self.row_parts]
        self.row_writers = writers + self._string_writers

    def record(self, n: int) -> None:
        """Record the current values as those of communication point `n`, if `n` is a multiple of the recording interval."""
        if n % self.every:
            return
        if not self.free_rows:
            self.start_chunk()
        row = self.row_count
        for write in self.row_writers:
            write(row)
        self.row_count = row + 1
        self.free_rows -= 1

    def last_point_in_chunk(self, n: int) -> int:
        """Return the last communication point after `n` whose row fits into the current chunk.

        A full chunk is replaced.
        """
        if not self.free_rows:
            self.start_chunk()
        return n - n % self.every + (self.free_rows + 1) * self.every - 1

    def set_row_count(self, rows: int) -> None:
        """Set the number of recorded rows, after an executor has written rows into the chunk."""
        self.free_rows -= rows - self.row_count
        self.row_count = rows

    def rewind(self, rows: int) -> None:
        """Forget all but the first `rows` rows.

        Results that share memory with the others keep them.
        """
        self.chunk, first = (
            self.row_store.rewind(rows).view(np.uint8),
            rows - rows % self.row_store.chunk_rows,
        )
        self.row_count = first
        self._use_chunk()
        self.set_row_count(rows)
        for column in self._string_columns.values():
            column.rewind(rows)

    @property
    def next_row_address(self) -> int:
        """Address of the next row in the current chunk."""
        return self._chunk_end - self.free_rows * self.row_store.dtype.itemsize

    @property
    def has_strings(self) -> bool:
        """Strings or binaries are recorded, which only Python can store."""
        return bool(self._string_columns)

    def recording(self) -> Recording:
        """Return everything recorded so far, with the columns in the order of `columns`."""
        rows = self.row_store.read_first(self.row_count)
        columns: dict[str, np.ndarray] = {}
        for name, variable in self.variables.items():
            values = (
                self._string_columns[name].column(self.row_count)
                if name in self._string_columns
                else rows[name]
            )
            columns[name] = (
                values.astype(bool, copy=False) if variable.type == "Boolean" else values
            )
        return Recording(self._times(), columns, self.units)

    def _times(self) -> np.ndarray:
        every = self.every
        return compute_in_chunks(
            self.row_count,
            lambda rows: self._plan.grid.times(range(rows.start * every, rows.stop * every, every)),
            np.dtype(np.float64),
        )

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column; "" if it has none."""
        return {
            name: variable.unit.name if variable.unit else ""
            for name, variable in self.variables.items()
        }


def _alignment_order(position: ArrayPosition) -> tuple[int, str, int]:
    """Return a sort key.

    Largest item size first, so that every value of a packed row is aligned.
    """
    return -position.dtype.itemsize, position.dtype.str, position.offset


def _buffer_writer(chunk: memoryview, buffer: memoryview, size: int, first: int) -> RowWriter:
    """Return a function that copies the whole buffer into a row of the chunk whose first row is `first`."""

    def write(row: int) -> None:
        begin = (row - first) * size
        chunk[begin : begin + size] = buffer

    return write


def _part_writer(chunk: np.ndarray, size: int, part: RowPart, first: int) -> RowWriter:
    """Return a function that writes a part into a row of the chunk whose first row is `first`."""
    source, indices, position = part
    shape, strides = (len(chunk) // size, len(indices)), (size, source.itemsize)
    cells = np.ndarray(shape, source.dtype, chunk.data, position, strides)
    columns = [
        (column.data, source.data, index)
        for column, index in zip(cells.T, indices[:MAX_SINGLE_COPIES].tolist(), strict=False)
    ]

    def write_each(row: int) -> None:
        for column, values, index in columns:
            column[row - first] = values[index]

    def write_all(row: int) -> None:
        source.take(indices, None, cells[row - first], "clip")

    return write_each if len(columns) == len(indices) else write_all


class _StringColumn:
    """Column of strings or binaries, stored as its changes."""

    def __init__(self, values: np.ndarray, index: int):
        self._values, self._index = values, index
        self._changes: list[tuple[int, Any]] = []

    def append(self, row: int) -> None:
        value = self._values[self._index]
        if not self._changes or self._changes[-1][1] != value:
            self._changes.append((row, value))

    def rewind(self, rows: int) -> None:
        self._changes = [change for change in self._changes if change[0] < rows]

    def column(self, rows: int) -> np.ndarray:
        values = np.empty(rows, object)
        for row, value in self._changes:
            values[row:] = value
        return values
