"""The native executor: the same plan, laid out for `_native.c`, which runs many macro steps per call."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from ..core.component import Access, Call, DoStep, Flags
from .component_step import Turn
from .executor import ROWS, Executor
from .parallel import TRIALS
from .transfer_plan import Gather

try:
    from . import _native
except ImportError:  # installed without a compiler
    _native = None  # type: ignore[assignment]

#: macro steps per call at most, but for the first call, which measures the steps of the components
BATCH = 1 << 16

#: what is reported beside FMI statuses, as in _native.c
_FLOAT_STATE_CHANGED, _NOT_FINITE = 1 << 33, 1 << 34


def available() -> bool:
    """Whether the native executor was built."""
    return _native is not None


class NativeExecutor(Executor):
    """Runs everything but Python components in C."""

    def _prepare(self) -> None:
        self._program = _native.Program(ctypes.addressof(self._clock), self.marker.ctypes.data, self._on_status)
        self._prepared = self.finished
        for gather in (gather for phase in self.plan.phases for gather in phase.gathers):
            if gather.delay and not gather.source.dtype.hasobject:
                self._delays[gather].rewind(self.finished)
        for phase, turns in zip(self.plan.phases, self._stages, strict=True):
            for gather in phase.gathers:
                self._add_move(gather)
            for turn in turns:
                self._add_turn(turn)
        watched = {array.dtype.itemsize: array for array in self.watched}
        self._program.watch(*(part for size in (8, 4) for part in _extent(watched.get(size, np.zeros(0)))))
        self._add_recording()

    # -- laying out ----------------------------------------------------------------------------------------------------

    def _add_move(self, gather: Gather) -> None:
        if gather.source.dtype.hasobject:
            self._add_object_move(self._move(gather))
            return
        first, count = int(gather.target_indices[0]), len(gather.target_indices)
        together = np.array_equal(gather.target_indices, np.arange(first, first + count))
        self._program.move(
            _address(gather.target[first:] if together else gather.target),
            gather.target.dtype.char.translate(_KINDS),
            0 if together else _address(gather.target_indices),
            _address(gather.source),
            gather.source.dtype.char.translate(_KINDS),
            _address(gather.source_indices),
            count,
            _address(gather.factor),
            _address(gather.offset),
            _address(self._delays[gather].ring) if gather.delay else 0,
            gather.delay,
        )

    def _add_object_move(self, move: Callable[[], object]) -> None:
        self._program.begin_turn(1)
        self._program.python(-1, _succeed, (move,))
        self._program.end_turn()

    def _add_turn(self, turn: Turn) -> None:
        self._program.begin_turn(turn.step.divisor)
        for number, call in enumerate(turn.calls, start=turn.first):
            self._add_call(number, call)
        self._program.end_turn()

    def _add_call(self, number: int, call: Call) -> None:
        program, native = self._program, call.native
        if isinstance(native, Access):
            program.access(number, *native)
        elif isinstance(native, DoStep):
            (program.step2 if native.version == 2 else program.step3)(number, *native[1:])
        elif isinstance(native, Flags):
            program.flags(number, 0, 0, 0.0, native.flags, 0)
        else:
            program.python(number, call.function, call.arguments)

    def _add_recording(self) -> None:
        recorder, block = self.recorder, self.plan.signals.block
        record = self._record if recorder.needs_python else None
        self._program.recording(
            recorder.every, recorder.store.dtype.itemsize, *(_extent(block) if recorder.whole else (0, 0)), record
        )
        for source, indices, position in recorder.pieces:
            self._program.piece(_address(source), _address(indices), len(indices), source.itemsize, position)

    # -- running -------------------------------------------------------------------------------------------------------

    def _steps(self, first: int, end: int) -> None:
        grid = self.plan.grid
        formula = grid.formula(end)
        count = min(end - first, self._batch(first)) if formula else 1
        self._program.row(self.recorder.chunk.ctypes.data + self.recorder.used)
        self._program.run(first, count, *(formula or (grid.seconds(first), 0.0, 1.0)))

    def _batch(self, first: int) -> int:
        """The first call of a program is short: it measures steps, and the next one packs the turns."""
        return BATCH if first >= self._prepared + TRIALS else TRIALS

    def _measured(self) -> dict[int, float]:
        return {self._turn_of(number)[0].first: nanoseconds * 1e-9 for number, nanoseconds in self._program.durations()}

    def _record(self, n: int) -> None:
        self.recorder.record(n)
        self.marker[ROWS] = self.recorder.rows

    def _on_status(self, number: int, status: int) -> int:
        """What a bad status means; returns 1 when the simulation shall end after this macro step, 2 when it was not finished."""
        if status == _NOT_FINITE:
            self._check_finite()
            return 0
        turn, call = self._turn_of(number)
        if status == _FLOAT_STATE_CHANGED:
            self._float_state_changed(turn, call)
        self._bad_status(turn, call, status)
        return 0 if self.termination is None else 1 if self.termination.complete else 2


#: numpy's characters for dtypes -> those of the struct module
_KINDS = str.maketrans({"l": "q", "L": "Q"})


def _address(array: np.ndarray | None) -> int:
    """Where the values lie, one after the other."""
    assert array is None or array.flags.c_contiguous
    return 0 if array is None else array.ctypes.data


def _extent(array: np.ndarray) -> tuple[int, int]:
    return array.ctypes.data, len(array)


def _succeed(move: Callable[[], object]) -> int:
    move()
    return 0


__all__ = ["NativeExecutor", "available"]
