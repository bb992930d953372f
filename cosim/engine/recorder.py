"""Recording: a row of values at every recorded communication point."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.recording import Recording
from ..core.system import Endpoint
from ..process.run_files.row_store import filled, rows_for
from .layout import Slot
from .plan import Plan
from .transfers import FEW

#: puts the present values into a row, given its number
Keeper = Callable[[int], object]


class Piece(NamedTuple):
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
        self.variables = {name: plan.system.place(endpoint).variable for name, endpoint in columns.items()}
        self._places = {name: plan.signals.places[endpoint] for name, endpoint in columns.items()}
        slots = sorted({slot for slot in self._places.values() if not slot.dtype.hasobject}, key=_order)
        #: the whole block of signals is a row
        self.whole = 2 * sum(slot.dtype.itemsize for slot in slots) >= plan.signals.block.nbytes > 0
        #: what a row consists of otherwise
        self.pieces: Sequence[Piece] = () if self.whole else list(self._pack(slots))
        dtype, expected = self._row_dtype(slots), plan.grid.count // every + 1
        self.store = rows_for(dtype, expected, file)
        #: rows recorded so far
        self.rows = 0
        self._texts = {name: _Texts(plan.signals.arrays[slot.dtype], slot.offset) for name, slot in self._texts_of().items()}
        #: what keeps a row's texts, and what keeps a row of the present chunk
        self._text_keepers: list[Keeper] = [texts.keep for texts in self._texts.values()]
        self.keepers: Sequence[Keeper] = ()
        #: rows that still fit into the present chunk, and the chunk's memory
        self.room, self.chunk = 0, np.zeros(0, np.uint8)

    def _texts_of(self) -> dict[str, Slot]:
        return {name: slot for name, slot in self._places.items() if slot.dtype.hasobject}

    def _pack(self, slots: Sequence[Slot]) -> Iterator[Piece]:
        position = 0
        for dtype, alike in groupby(slots, lambda slot: slot.dtype):
            offsets = np.array([slot.offset for slot in alike], np.intp)
            yield Piece(self._plan.signals.arrays[dtype], offsets, position)
            position += len(offsets) * dtype.itemsize

    def _row_dtype(self, slots: Sequence[Slot]) -> np.dtype[Any]:
        """The row as a structured dtype with the recorded names as fields; two names of one signal share their memory."""
        signals = self._plan.signals
        if self.whole:
            positions = {slot: signals.position(slot) for slot in slots}
        else:
            ends = np.cumsum([0, *(slot.dtype.itemsize for slot in slots)]).tolist()
            positions = dict(zip(slots, ends, strict=False))
        size = signals.block.nbytes if self.whole else -(-sum(slot.dtype.itemsize for slot in slots) // 8) * 8
        fields = {name: slot for name, slot in self._places.items() if not slot.dtype.hasobject}
        return np.dtype(
            {
                "names": list(fields),
                "formats": [slot.dtype for slot in fields.values()],
                "offsets": [positions[slot] for slot in fields.values()],
                "itemsize": size,
            }
        )

    def extend(self) -> None:
        """A new chunk, when the present one is full."""
        chunk = self.store.extend()
        self.room, self.chunk = len(chunk), chunk.view(np.uint8) if chunk.dtype.itemsize else np.zeros(0, np.uint8)
        size, first = self.store.dtype.itemsize, self.rows
        if self.whole:
            keepers = [_block_keeper(self.chunk.data, self._plan.signals.block.data, size, first)]
        else:
            keepers = [_piece_keeper(self.chunk, size, piece, first) for piece in self.pieces]
        self.keepers = keepers + self._text_keepers

    def record(self, n: int) -> None:
        """Keep the present values as those of communication point n, if it is one to be recorded."""
        if n % self.every:
            return
        if not self.room:
            self.extend()
        row = self.rows
        for keep in self.keepers:
            keep(row)
        self.rows = row + 1
        self.room -= 1

    def full_after(self, n: int) -> int:
        """The last communication point after n whose row fits into the present chunk; a new chunk, when it is full now."""
        if not self.room:
            self.extend()
        return n - n % self.every + (self.room + 1) * self.every - 1

    def advance(self, rows: int) -> None:
        """Rows until this number were put into the chunk by someone else."""
        self.room -= rows - self.rows
        self.rows = rows

    @property
    def used(self) -> int:
        """Bytes of the present chunk that are in use."""
        return len(self.chunk) - self.room * self.store.dtype.itemsize

    @property
    def needs_python(self) -> bool:
        """Rows are more than copies of memory: there are texts."""
        return bool(self._texts)

    def recording(self) -> Recording:
        """Everything recorded so far; columns in the order they were asked for."""
        rows = self.store.first(self.rows)
        columns: dict[str, np.ndarray] = {}
        for name, variable in self.variables.items():
            values = self._texts[name].column(self.rows) if name in self._texts else rows[name]
            columns[name] = values.astype(bool, copy=False) if variable.type == "Boolean" else values
        return Recording(self._times(), columns, self.units)

    def _times(self) -> np.ndarray:
        every = self.every
        return filled(
            self.rows,
            lambda rows: self._plan.grid.times(range(rows.start * every, rows.stop * every, every)),
            np.dtype(np.float64),
        )

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column, "" where it is unknown."""
        return {name: variable.unit.name if variable.unit else "" for name, variable in self.variables.items()}


def _order(slot: Slot) -> tuple[int, str, int]:
    """The widest first, so that every value of a packed row is aligned."""
    return -slot.dtype.itemsize, slot.dtype.str, slot.offset


def _block_keeper(chunk: memoryview, block: memoryview, size: int, first: int) -> Keeper:
    """Puts the whole block into a row of the chunk whose first row is `first`."""

    def keep(row: int) -> None:
        begin = (row - first) * size
        chunk[begin : begin + size] = block

    return keep


def _piece_keeper(chunk: np.ndarray, size: int, piece: Piece, first: int) -> Keeper:
    """Puts a piece into a row of the chunk whose first row is `first`."""
    source, indices, position = piece
    shape, strides = (len(chunk) // size, len(indices)), (size, source.itemsize)
    cells = np.ndarray(shape, source.dtype, chunk.data, position, strides)
    columns = [(column.data, source.data, index) for column, index in zip(cells.T, indices[:FEW].tolist(), strict=False)]

    def keep_each(row: int) -> None:
        for column, values, index in columns:
            column[row - first] = values[index]

    def keep_all(row: int) -> None:
        source.take(indices, None, cells[row - first], "clip")

    return keep_each if len(columns) == len(indices) else keep_all


class _Texts:
    """A column of texts or binaries, kept as its changes."""

    def __init__(self, values: np.ndarray, place: int):
        self._values, self._place = values, place
        self._changes: list[tuple[int, Any]] = []

    def keep(self, row: int) -> None:
        value = self._values[self._place]
        if not self._changes or self._changes[-1][1] != value:
            self._changes.append((row, value))

    def column(self, rows: int) -> np.ndarray:
        values = np.empty(rows, object)
        for row, value in self._changes:
            values[row:] = value
        return values
