"""The native executor: the same plan, laid out for `_native.c`, which runs many macro steps per call."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

import numpy as np

from ..core.component import NativeDoStep, NativeFlagCheck, NativeGetSet, PreparedCall
from ..process.journal import ROW_COUNT
from .component_step import ScheduledStep
from .executor import Executor
from .parallel import MEASURED_STEPS
from .transfer_plan import Transfer

try:
    from . import _native
except ImportError:  # installed without a compiler
    _native = None  # type: ignore[assignment]

#: macro steps per call at most, but for the first call, which measures the steps of the components
MAX_STEPS_PER_CALL = 1 << 16

#: what is reported beside FMI statuses, as in _native.c
_FLOAT_STATE_CHANGED, _NOT_FINITE = 1 << 33, 1 << 34


def native_available() -> bool:
    """Whether the native executor was built."""
    return _native is not None


class NativeExecutor(Executor):
    """Runs everything but Python components in C."""

    def _prepare(self) -> None:
        self._program = _native.Program(ctypes.addressof(self._current_time), self.marker.ctypes.data, self._on_status)
        self._program_start = self.completed_steps
        for gather in (gather for phase in self.plan.phases for gather in phase.transfers):
            if gather.delay and not gather.source.dtype.hasobject:
                self._delay_lines[gather].align_ring(self.completed_steps)
        for phase, turns in zip(self.plan.phases, self._phase_steps, strict=True):
            for gather in phase.transfers:
                self._add_transfer(gather)
            for turn in turns:
                self._add_step(turn)
        watched = {array.dtype.itemsize: array for array in self.monitored_floats}
        self._program.set_monitored_floats(
            *(part for size in (8, 4) for part in _address_and_length(watched.get(size, np.zeros(0))))
        )
        self._add_recording()

    # -- laying out ----------------------------------------------------------------------------------------------------

    def _add_transfer(self, gather: Transfer) -> None:
        if gather.source.dtype.hasobject:
            self._add_object_transfer(self._transfer_call(gather))
            return
        first, count = int(gather.target_indices[0]), len(gather.target_indices)
        together = np.array_equal(gather.target_indices, np.arange(first, first + count))
        self._program.add_transfer(
            _address(gather.target[first:] if together else gather.target),
            gather.target.dtype.char.translate(_STRUCT_CODES),
            0 if together else _address(gather.target_indices),
            _address(gather.source),
            gather.source.dtype.char.translate(_STRUCT_CODES),
            _address(gather.source_indices),
            count,
            _address(gather.factor),
            _address(gather.offset),
            _address(self._delay_lines[gather].ring) if gather.delay else 0,
            gather.delay,
        )

    def _add_object_transfer(self, move: Callable[[], object]) -> None:
        self._program.begin_step(1)
        self._program.add_python_call(-1, _call_and_return_ok, (move,))
        self._program.end_step()

    def _add_step(self, turn: ScheduledStep) -> None:
        self._program.begin_step(turn.step.divisor)
        for number, call in enumerate(turn.calls, start=turn.first_call):
            self._add_call(number, call)
        self._program.end_step()

    def _add_call(self, number: int, call: PreparedCall) -> None:
        program, native = self._program, call.native
        if isinstance(native, NativeGetSet):
            program.add_get_set(number, *native)
        elif isinstance(native, NativeDoStep):
            (program.add_do_step2 if native.version == 2 else program.add_do_step3)(number, *native[1:])
        elif isinstance(native, NativeFlagCheck):
            program.add_flag_check(number, 0, 0, 0.0, native.flags, 0)
        else:
            program.add_python_call(number, call.function, call.arguments)

    def _add_recording(self) -> None:
        recorder, block = self.recorder, self.plan.outputs.buffer
        record = self._record if recorder.has_strings else None
        self._program.set_recording(
            recorder.every,
            recorder.row_store.dtype.itemsize,
            *(_address_and_length(block) if recorder.whole_buffer else (0, 0)),
            record,
        )
        for source, indices, position in recorder.row_parts:
            self._program.add_row_part(_address(source), _address(indices), len(indices), source.itemsize, position)

    # -- running -------------------------------------------------------------------------------------------------------

    def _run_macro_steps(self, first: int, end: int) -> None:
        grid = self.plan.grid
        formula = grid.float_coefficients(end)
        count = min(end - first, self._steps_per_call(first)) if formula else 1
        self._program.set_row_address(self.recorder.chunk.ctypes.data + self.recorder.chunk_bytes_used)
        self._program.run(first, count, *(formula or (grid.time_at(first), 0.0, 1.0)))

    def _steps_per_call(self, first: int) -> int:
        """The first call of a program is short: it measures steps, and the next one packs the turns."""
        return MAX_STEPS_PER_CALL if first >= self._program_start + MEASURED_STEPS else MEASURED_STEPS

    def _step_durations(self) -> dict[int, float]:
        return {
            self._find_call(number)[0].first_call: nanoseconds * 1e-9 for number, nanoseconds in self._program.step_durations()
        }

    def _record(self, n: int) -> None:
        self.recorder.record(n)
        self.marker[ROW_COUNT] = self.recorder.row_count

    def _on_status(self, number: int, status: int) -> int:
        """What a bad status means; returns 1 when the simulation shall end after this macro step, 2 when it was not finished."""
        if status == _NOT_FINITE:
            self._check_finite()
            return 0
        turn, call = self._find_call(number)
        if status == _FLOAT_STATE_CHANGED:
            self._raise_float_mode_changed(turn, call)
        self._handle_status(turn, call, status)
        return 0 if self.termination is None else 1 if self.termination.complete else 2


#: numpy's characters for dtypes -> those of the struct module
_STRUCT_CODES = str.maketrans({"l": "q", "L": "Q"})


def _address(array: np.ndarray | None) -> int:
    """Where the values lie, one after the other."""
    assert array is None or array.flags.c_contiguous
    return 0 if array is None else array.ctypes.data


def _address_and_length(array: np.ndarray) -> tuple[int, int]:
    return array.ctypes.data, len(array)


def _call_and_return_ok(move: Callable[[], object]) -> int:
    move()
    return 0


__all__ = ["NativeExecutor", "native_available"]
