"""The native executor: passes the plan to `_native.c`, which runs many macro steps per call."""

import ctypes
from collections.abc import Callable
from fractions import Fraction

import numpy as np

from ..core.component import NativeDoStep, NativeFlagCheck, NativeGetSet, PreparedCall
from ..core.errors import InputError
from ..process.journal import ROW_COUNT
from .executor import Executor
from .transfer_plan import Transfer, contiguous_views

try:
    import cosim.engine._native as _native
except ImportError:  # installed without a C compiler
    _native = None  # type: ignore[assignment]  # a module cannot be declared optional

#: number of the interface of `_native.c`; raised with every change of a function, an argument, a
#: code or the marker
INTERFACE = 9
#: average number of values in contiguous runs from which a run is copied as a block of memory
MIN_BLOCK_VALUES = 8
#: most macro steps per call; the first call is shorter, because it measures the durations of the
#: steps
MAX_STEPS_PER_CALL = 1 << 16


def native_available() -> bool:
    """Return whether the native executor was built.

    Raises:
        InputError: it was built from older or newer sources than this module, as happens in an
            editable installation.
    """
    if _native is None:
        return False
    found = getattr(_native, "INTERFACE", 0)
    if found != INTERFACE:
        raise InputError(
            f"the native executor {_native.__file__} has interface {found}, expected {INTERFACE}: "
            "build it again with "
            "`python setup.py build_ext --inplace` in the checkout"
        )
    return True


class NativeExecutor(Executor):
    """Executor that runs everything except Python components in C."""

    def _prepare(self) -> None:
        current_time = ctypes.addressof(self._runner.current_time)
        self._program = _native.Program(current_time, self.marker.ctypes.data, self._on_status)
        self._program_start = self.completed_steps
        for phase, steps in zip(self.plan.phases, self._schedule.phases, strict=True):
            for transfer in phase.transfers:
                self._add_transfer(transfer)
            for step in steps:
                self._program.begin_step(step.step.divisor)
                for number, call in enumerate(step.calls, start=step.first_call):
                    self._add_call(number, call)
                self._program.end_step()
        by_item_size = {
            array.dtype.itemsize: array for array in self._finite_check.monitored_floats
        }
        doubles, singles = (
            _address_and_length(by_item_size.get(size, np.zeros(0))) for size in (8, 4)
        )
        self._program.set_monitored_floats(*doubles, *singles)
        self._add_recording()
        for instructions in self.stop_conditions.instructions():
            self._program.begin_condition()
            for each, source in instructions:
                kind = source.dtype.char.translate(_STRUCT_CODES)
                self._program.add_instruction(
                    getattr(_native, each.operation), each.value, _address(source), kind, each.skip
                )

    def _native_transfers(self, transfer: Transfer) -> int:
        in_loop = all(transfer not in phase.transfers for phase in self.plan.phases)
        return (
            0
            if in_loop or transfer.source.dtype.hasobject
            else self.completed_steps - self._program_start
        )

    # -- adding operations

    def _add_transfer(self, transfer: Transfer) -> None:
        if transfer.source.dtype.hasobject:
            self._program.begin_step(1)
            call = self._transfer_call(transfer)
            self._program.add_python_call(-1, _call_and_return_ok, (call,))
            self._program.end_step()
            return
        views = contiguous_views(transfer)
        if views and len(transfer.target_indices) >= MIN_BLOCK_VALUES * len(views):
            for target, source in views:
                self._program.add_block_copy(
                    _address(np.asarray(target)), _address(np.asarray(source)), target.nbytes
                )
            return
        first, count = int(transfer.target_indices[0]), len(transfer.target_indices)
        is_contiguous = transfer.slope_indices is None and np.array_equal(
            transfer.target_indices, np.arange(first, first + count)
        )
        self._program.add_transfer(
            _address(transfer.target[first:] if is_contiguous else transfer.target),
            transfer.target.dtype.char.translate(_STRUCT_CODES),
            0 if is_contiguous else _address(transfer.target_indices),
            _address(transfer.source),
            transfer.source.dtype.char.translate(_STRUCT_CODES),
            _address(transfer.source_indices),
            count,
            _address(transfer.factor),
            _address(transfer.offset),
            _address(self._delay_lines[transfer].ring) if transfer.delay else 0,
            transfer.delay,
            transfer.term_count,
            _address(transfer.slope_indices),
            transfer.interpolates,
            self._delay_lines[transfer].step_size if transfer.delay else 0.0,
        )

    def _add_call(self, number: int, call: PreparedCall) -> None:
        program, native = self._program, call.native
        if isinstance(native, NativeGetSet):
            program.add_get_set(number, *native)
        elif isinstance(native, NativeDoStep):
            (program.add_do_step2 if native.version == 2 else program.add_do_step3)(
                number, *native[1:]
            )
        elif isinstance(native, NativeFlagCheck):
            program.add_flag_check(number, 0, 0, 0.0, native.flags, 0)
        else:
            program.add_python_call(number, call.function, call.arguments)

    def _add_recording(self) -> None:
        recorder, buffer = self.recorder, self.plan.outputs.buffer
        self._program.set_recording(
            recorder.every,
            recorder.row_store.dtype.itemsize,
            *(_address_and_length(buffer) if recorder.whole_buffer else (0, 0)),
            self._record if recorder.has_strings else None,
        )
        for source, indices, position in recorder.row_parts:
            self._program.add_row_part(
                _address(source), _address(indices), len(indices), source.itemsize, position
            )

    # -- running

    def record_between(self, time: Fraction | float) -> None:
        """Record the present outputs as a row at a time that is not a communication point."""
        super().record_between(time)
        self._use_rows()

    def _run_macro_steps(self, first: int, end: int) -> None:
        grid = self.plan.grid
        measured = first >= self._program_start + _native.MEASURED_STEPS
        end = min(end, first + (MAX_STEPS_PER_CALL if measured else _native.MEASURED_STEPS))
        coefficients = grid.coefficients(end)
        if coefficients is None:
            end, coefficients = first + 1, (grid.time_at(first + 1), 0.0, 1.0)
        self._use_rows()
        self._program.set_wake_point(self.stop_conditions.wake_point)
        self._program.run(first, end - first, grid.time_at(first), *coefficients)

    def _use_rows(self) -> None:
        """Pass the memory of the next rows to the program, which writes them unless Python does."""
        recorder = self.recorder
        by_python = recorder.has_strings
        self._program.set_rows(*((0, 1) if by_python else (recorder.next_row, recorder.free_rows)))

    def _step_durations(self) -> dict[int, float]:
        durations = self._program.step_durations()
        return {
            self._schedule.find_call(number)[0].first_call: nanoseconds * 1e-9
            for number, nanoseconds in durations
        }

    def _record(self, time: float) -> None:
        self.recorder.record(time)
        self.marker[ROW_COUNT] = self.recorder.row_count

    def _on_status(self, number: int, status: int) -> int:
        """Handle a status of call `number` that is no success; return how the run continues."""
        if status == _native.NOT_FINITE:
            self._finite_check.run()
            return _native.CONTINUE
        if status == _native.FLOAT_MODE_CHANGED:
            self._restore_float_mode(number)
            return _native.CONTINUE
        if status == _native.FLOAT_TRAPS_ENABLED:
            self._restore_float_traps(self.completed_steps + 1)
            return _native.CONTINUE
        if status == _native.CONDITIONS_CHANGED:
            self._check_stop_conditions(self.completed_steps)
            self._program.set_wake_point(self.stop_conditions.wake_point)
        else:
            self._runner.handle_status(*self._schedule.find_call(number), status)
        if self.termination is None:
            return _native.CONTINUE
        return _native.END_AFTER_STEP if self.termination.complete else _native.END_BEFORE_STEP


#: NumPy's dtype characters -> format characters of the struct module
_STRUCT_CODES = str.maketrans({"l": "q", "L": "Q"})


def _address(array: np.ndarray | None) -> int:
    """Return the address of a C-contiguous array; 0 for None."""
    assert array is None or array.flags.c_contiguous
    return 0 if array is None else array.ctypes.data


def _address_and_length(array: np.ndarray) -> tuple[int, int]:
    return array.ctypes.data, len(array)


def _call_and_return_ok(transfer_call: Callable[[], object]) -> int:
    transfer_call()
    return 0
