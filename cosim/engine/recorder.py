"""Recording of outputs: rows of a time and the present values.

The executors record every `every`-th communication point. Further rows may lie between these, and
several rows may have the same time. A recording that does not fit on the disk is refused before.
"""

import shutil
from collections.abc import Callable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import Problem
from ..core.recording import Recording
from ..core.text import count_noun
from ..process.row_store import MAX_MEMORY_BYTES, open_row_store
from ..process.run_files import (
    ROWS_FILE,
    SIGNALS,
    TIME,
    TIME_SIZE,
    Column,
    RowLayout,
    RowsFile,
    text_column,
)
from ..results.csv_files import BYTES_PER_NUMBER
from .layout import ArrayPosition
from .plan import Plan
from .transfer_plan import MAX_SINGLE_COPIES

#: writes the current values into the row with this number
RowWriter = Callable[[int], object]


class RowPart(NamedTuple):
    """Values of one dtype in a row: `source[indices]`, written at `position` (bytes)."""

    source: np.ndarray
    indices: np.ndarray
    position: int


class Recorder:
    """Stores the values of the recorded outputs.

    The signals of a row are a copy of the whole output buffer if more than half of it is recorded;
    otherwise a row contains only the recorded values. Strings and binaries are stored in memory,
    apart from the rows.

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
            {p for p in self._positions.values() if not p.dtype.hasobject},
            # largest item size first, so that every value of a packed row is aligned
            key=lambda position: (-position.dtype.itemsize, position.dtype.str, position.offset),
        )
        #: a row contains a copy of the whole output buffer
        recorded_bytes = sum(position.dtype.itemsize for position in numeric)
        self.whole_buffer = 2 * recorded_bytes > plan.outputs.buffer.nbytes
        #: the parts of a row otherwise
        self.row_parts: Sequence[RowPart] = (
            () if self.whole_buffer else list(self._pack_row(numeric))
        )
        self.layout = self._row_layout(numeric)
        self.row_store = open_row_store(self.layout.dtype, plan.row_count, file)
        #: number of rows recorded so far
        self.row_count = 0
        #: first row of the current chunk, and the row after it
        self._first = self._end = 0
        self._string_columns = {
            name: _StringColumn(plan.outputs.arrays[position.dtype], position.offset)
            for name, position in self._positions.items()
            if position.dtype.hasobject
        }
        self._string_writers: list[RowWriter] = [
            column.append for column in self._string_columns.values()
        ]
        self._writers: Sequence[RowWriter] = ()

    def _pack_row(self, numeric: Sequence[ArrayPosition]) -> Iterator[RowPart]:
        row_offset = TIME_SIZE
        for dtype, positions in groupby(numeric, lambda position: position.dtype):
            indices = np.array([position.offset for position in positions], np.intp)
            yield RowPart(self._plan.outputs.arrays[dtype], indices, row_offset)
            row_offset += len(indices) * dtype.itemsize

    def _row_layout(self, numeric: Sequence[ArrayPosition]) -> RowLayout:
        """Return the layout of a row; several names of one output share its bytes."""
        outputs = self._plan.outputs
        ends = np.cumsum([0, *(position.dtype.itemsize for position in numeric)]).tolist()
        offsets = dict(zip(numeric, ends, strict=False))
        if self.whole_buffer:
            offsets = {position: outputs.byte_offset(position) for position in numeric}
        columns, texts = [], []
        for i, (name, position) in enumerate(self._positions.items()):
            if position.dtype.hasobject:
                texts.append((i, name))
                continue
            boolean, unit = self.variables[name].type == "Boolean", self.units[name]
            columns.append(Column(name, position.dtype.str, offsets[position], boolean, unit))
        size = outputs.buffer.nbytes if self.whole_buffer else ends[-1]
        return RowLayout(-(-size // TIME_SIZE) * TIME_SIZE, columns, texts)

    def write_header(self, call_names: Sequence[tuple[str, str]]) -> None:
        """Write a description of the rows for other processes, after the first row.

        This recorder keeps its rows private and writes none.
        """

    def provide_rows(self) -> None:
        """Provide space for the next row if the current chunk is full."""
        if self.row_count == self._end:
            self._open_chunk(self.row_count)

    def _open_chunk(self, rows: int) -> None:
        """Write further rows after the first `rows` ones."""
        first, chunk = self.row_store.provide_chunk(rows)
        memory, size = chunk.view(np.uint8), chunk.itemsize
        if self.whole_buffer:
            writers = [_buffer_writer(memory.data, self._plan.outputs.buffer.data, size, first)]
        else:
            writers = [_part_writer(memory, size, part, first) for part in self.row_parts]
        self._writers = writers + self._string_writers
        self._times: Any = chunk[TIME].data
        self._first, self._end, self.row_count = first, first + len(chunk), rows
        self._chunk_end = memory.ctypes.data + len(memory)

    def record(self, time: float) -> None:
        """Record the current values as those at `time` (s).

        The time is written last: other processes take a row whose time is 0 for an incomplete one.
        """
        row = self.row_count
        if row == self._end:
            self._open_chunk(row)
        for write in self._writers:
            write(row)
        self._times[row - self._first] = time
        self.row_count = row + 1

    def rewind(self, rows: int) -> None:
        """Forget all but the first `rows` rows.

        Results that share memory with the others keep them.
        """
        self._open_chunk(rows)
        for column in self._string_columns.values():
            column.rewind(rows)

    @property
    def last_time(self) -> float:
        """Time of the last row (s)."""
        return float(self.row_store.read_first(self.row_count)[TIME][-1])

    @property
    def free_rows(self) -> int:
        """Number of rows that still fit into the current chunk."""
        return self._end - self.row_count

    @property
    def next_row(self) -> int:
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
                else rows[SIGNALS][name]
            )
            columns[name] = (
                values.astype(bool, copy=False) if variable.type == "Boolean" else values
            )
        time = rows[TIME]
        if time.nbytes <= MAX_MEMORY_BYTES:  # many functions read it, faster if contiguous
            time = np.ascontiguousarray(time)
        return Recording(time, columns, self.units)

    @property
    def units(self) -> dict[str, str]:
        """Unit of each column; "" if it has none."""
        return {
            name: variable.unit.name if variable.unit else ""
            for name, variable in self.variables.items()
        }


def _buffer_writer(chunk: memoryview, buffer: memoryview, size: int, first: int) -> RowWriter:
    """Return a function that copies the buffer to a row of the chunk that begins at row `first`."""
    length = len(buffer)

    def write(row: int) -> None:
        begin = (row - first) * size + TIME_SIZE
        chunk[begin : begin + length] = buffer

    return write


def _part_writer(chunk: np.ndarray, size: int, part: RowPart, first: int) -> RowWriter:
    """Return a function that writes a part into a row of the chunk that begins at row `first`."""
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
        #: values with the row in which each begins
        self.changes: list[tuple[int, Any]] = []

    def append(self, row: int) -> None:
        value = self._values[self._index]
        if not self.changes or self.changes[-1][1] != value:
            self.changes.append((row, value))

    def rewind(self, rows: int) -> None:
        self.changes = [change for change in self.changes if change[0] < rows]

    def column(self, rows: int) -> np.ndarray:
        return text_column(self.changes, rows)


class SavingRecorder(Recorder):
    """Recorder whose rows and strings survive the process (see `process.run_files`).

    Args:
        plan: the compiled system.
        folder: folder of the unfinished run.
    """

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(plan, folder / ROWS_FILE)
        self._file = RowsFile(folder, self.layout)
        if self._string_columns:
            self._file.write_texts(0, {})
            self._string_writers.append(self._save_changed_strings)

    def write_header(self, call_names: Sequence[tuple[str, str]]) -> None:
        """Write layout and calls (component, function) to the folder of the unfinished run."""
        self._file.write_header(call_names)

    def _save_changed_strings(self, row: int) -> None:
        changed = {}
        for name, column in self._string_columns.items():
            begin, value = column.changes[-1]
            if begin == row:
                changed[name] = value
        if changed:
            self._file.write_texts(row, changed)


#: size of a number in the rows (bytes), approximately
_BYTES_PER_VALUE = 8
#: size of the recording (bytes) from which the free disk space is checked
_SIZE_CHECK_THRESHOLD = 1_000_000_000


def find_space_problems(plan: Plan, folder: Path, csv: bool, replaced: int = 0) -> list[Problem]:
    """Return a problem if the recording is larger than the free disk space; empty if it fits.

    Args:
        plan: the compiled system.
        folder: folder of the rows.
        csv: a CSV file is written there, too.
        replaced: size of the files there that are removed before (bytes).
    """
    rows, columns = plan.row_count, len(plan.settings.columns)
    size = rows * (columns + 1) * (_BYTES_PER_VALUE + csv * BYTES_PER_NUMBER)
    if size < _SIZE_CHECK_THRESHOLD or size <= (free := shutil.disk_usage(folder).free + replaced):
        return []
    amount = f"{count_noun(rows, 'row')} of {count_noun(columns, 'signal')}"
    text = f"{amount} take about {size / 1e9:.3g} GB, {free / 1e9:.3g} GB are free in {folder}"
    return [
        Problem(
            f'{text}; make the step longer, or set "record": {{"interval": ...}}',
            subject=("step_size",),
        )
    ]
