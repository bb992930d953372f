"""Recording: a row of values at every recorded communication point."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.recording import Recording
from ..core.system import Endpoint
from ..process.run_files.row_store import compute_in_chunks, open_row_store
from .layout import ArrayPosition
from .plan import Plan
from .transfer_calls import MAX_SINGLE_COPIES

#: puts the present values into a row, given its number
RowWriter = Callable[[int], object]


class RowPart(NamedTuple):
    """Values of one dtype that go into each row: from these places of the signals, to this position in the row (bytes)."""

    source: np.ndarray
    indices: np.ndarray
    position: int


class Recorder:
    """Keeps the values of `columns` (recorded name -> output) at every `every`-th communication point.

    A row is the whole block of signals when at least half of it is wanted (one copy of memory), else only what is wanted,
    packed. With `file` the rows lie in that file; very many lie in a temporary one. Texts are kept apart, in memory.
    """

    def __init__(self, plan: Plan, columns: Mapping[str, Endpoint], every: int = 1, file: Path | None = None):
        self._plan, self.every = plan, every
        #: recorded name -> the variable it belongs to
        self.variables = {name: plan.system.find_element(endpoint).variable for name, endpoint in columns.items()}
        self._positions = {name: plan.outputs.positions[endpoint] for name, endpoint in columns.items()}
        slots = sorted({slot for slot in self._positions.values() if not slot.dtype.hasobject}, key=_alignment_order)
        #: the whole block of signals is a row
        self.whole_buffer = 2 * sum(slot.dtype.itemsize for slot in slots) >= plan.outputs.buffer.nbytes > 0
        #: what a row consists of otherwise
        self.row_parts: Sequence[RowPart] = () if self.whole_buffer else list(self._pack_row(slots))
        dtype, expected = self._row_dtype(slots), plan.grid.count // every + 1
        self.row_store = open_row_store(dtype, expected, file)
        #: rows recorded so far
        self.row_count = 0
        self._string_columns = {
            name: _StringColumn(plan.outputs.arrays[slot.dtype], slot.offset) for name, slot in self._string_positions().items()
        }
        #: what keeps a row's texts, and what keeps a row of the present chunk
        self._string_writers: list[RowWriter] = [texts.append for texts in self._string_columns.values()]
        self.row_writers: Sequence[RowWriter] = ()
        #: rows that still fit into the present chunk, and the chunk's memory
        self.free_rows, self.chunk = 0, np.zeros(0, np.uint8)

    def _string_positions(self) -> dict[str, ArrayPosition]:
        return {name: slot for name, slot in self._positions.items() if slot.dtype.hasobject}

    def _pack_row(self, slots: Sequence[ArrayPosition]) -> Iterator[RowPart]:
        position = 0
        for dtype, alike in groupby(slots, lambda slot: slot.dtype):
            offsets = np.array([slot.offset for slot in alike], np.intp)
            yield RowPart(self._plan.outputs.arrays[dtype], offsets, position)
            position += len(offsets) * dtype.itemsize

    def _row_dtype(self, slots: Sequence[ArrayPosition]) -> np.dtype[Any]:
        """The row as a structured dtype with the recorded names as fields; two names of one signal share their memory."""
        signals = self._plan.outputs
        if self.whole_buffer:
            positions = {slot: signals.byte_offset(slot) for slot in slots}
        else:
            ends = np.cumsum([0, *(slot.dtype.itemsize for slot in slots)]).tolist()
            positions = dict(zip(slots, ends, strict=False))
        size = signals.buffer.nbytes if self.whole_buffer else -(-sum(slot.dtype.itemsize for slot in slots) // 8) * 8
        fields = {name: slot for name, slot in self._positions.items() if not slot.dtype.hasobject}
        return np.dtype(
            {
                "names": list(fields),
                "formats": [slot.dtype for slot in fields.values()],
                "offsets": [positions[slot] for slot in fields.values()],
                "itemsize": size,
            }
        )

    def start_chunk(self) -> None:
        """A new chunk, when the present one is full."""
        chunk = self.row_store.add_chunk()
        self.free_rows, self.chunk = len(chunk), chunk.view(np.uint8) if chunk.dtype.itemsize else np.zeros(0, np.uint8)
        size, first = self.row_store.dtype.itemsize, self.row_count
        if self.whole_buffer:
            keepers = [_buffer_writer(self.chunk.data, self._plan.outputs.buffer.data, size, first)]
        else:
            keepers = [_part_writer(self.chunk, size, piece, first) for piece in self.row_parts]
        self.row_writers = keepers + self._string_writers

    def record(self, n: int) -> None:
        """Keep the present values as those of communication point n, if it is one to be recorded."""
        if n % self.every:
            return
        if not self.free_rows:
            self.start_chunk()
        row = self.row_count
        for keep in self.row_writers:
            keep(row)
        self.row_count = row + 1
        self.free_rows -= 1

    def last_point_in_chunk(self, n: int) -> int:
        """The last communication point after n whose row fits into the present chunk; a new chunk, when it is full now."""
        if not self.free_rows:
            self.start_chunk()
        return n - n % self.every + (self.free_rows + 1) * self.every - 1

    def set_row_count(self, rows: int) -> None:
        """Rows until this number were put into the chunk by someone else."""
        self.free_rows -= rows - self.row_count
        self.row_count = rows

    @property
    def chunk_bytes_used(self) -> int:
        """Bytes of the present chunk that are in use."""
        return len(self.chunk) - self.free_rows * self.row_store.dtype.itemsize

    @property
    def has_strings(self) -> bool:
        """Rows are more than copies of memory: there are texts."""
        return bool(self._string_columns)

    def recording(self) -> Recording:
        """Everything recorded so far; columns in the order they were asked for."""
        rows = self.row_store.read_first(self.row_count)
        columns: dict[str, np.ndarray] = {}
        for name, variable in self.variables.items():
            values = self._string_columns[name].column(self.row_count) if name in self._string_columns else rows[name]
            columns[name] = values.astype(bool, copy=False) if variable.type == "Boolean" else values
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
        """Unit of each column, "" where it is unknown."""
        return {name: variable.unit.name if variable.unit else "" for name, variable in self.variables.items()}


def _alignment_order(slot: ArrayPosition) -> tuple[int, str, int]:
    """The widest first, so that every value of a packed row is aligned."""
    return -slot.dtype.itemsize, slot.dtype.str, slot.offset


def _buffer_writer(chunk: memoryview, block: memoryview, size: int, first: int) -> RowWriter:
    """Puts the whole block into a row of the chunk whose first row is `first`."""

    def keep(row: int) -> None:
        begin = (row - first) * size
        chunk[begin : begin + size] = block

    return keep


def _part_writer(chunk: np.ndarray, size: int, piece: RowPart, first: int) -> RowWriter:
    """Puts a piece into a row of the chunk whose first row is `first`."""
    source, indices, position = piece
    shape, strides = (len(chunk) // size, len(indices)), (size, source.itemsize)
    cells = np.ndarray(shape, source.dtype, chunk.data, position, strides)
    columns = [
        (column.data, source.data, index) for column, index in zip(cells.T, indices[:MAX_SINGLE_COPIES].tolist(), strict=False)
    ]

    def keep_each(row: int) -> None:
        for column, values, index in columns:
            column[row - first] = values[index]

    def keep_all(row: int) -> None:
        source.take(indices, None, cells[row - first], "clip")

    return keep_each if len(columns) == len(indices) else keep_all


class _StringColumn:
    """A column of texts or binaries, kept as its changes."""

    def __init__(self, values: np.ndarray, place: int):
        self._values, self._index = values, place
        self._changes: list[tuple[int, Any]] = []

    def append(self, row: int) -> None:
        value = self._values[self._index]
        if not self._changes or self._changes[-1][1] != value:
            self._changes.append((row, value))

    def column(self, rows: int) -> np.ndarray:
        values = np.empty(rows, object)
        for row, value in self._changes:
            values[row:] = value
        return values
