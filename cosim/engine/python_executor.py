"""The pure Python executor, which calls C functions through ctypes and is always available."""

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain, compress, pairwise
from math import inf
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..core.component import SUCCESS_STATUSES, NativeDoStep, PreparedCall
from ..process import float_mode
from ..process.journal import CALL_NUMBER, ROW_COUNT, STEP_COUNT
from .executor import Executor
from .parallel import MEASURED_STEPS
from .plan import Phase, Plan, ScheduledStep
from .recorder import Recorder
from .transfer_plan import TransferCall, contiguous_views

#: most macro steps whose times are computed at once
MAX_STEPS_PER_CALL = 1 << 12
#: number of floats from which NumPy extracts the exponent bytes faster than Python
MIN_NUMPY_FLOATS = 256

#: number of the call (for the marker), function, arguments
NumberedCall = tuple[int, Callable[..., int], tuple[Any, ...]]


class _CompiledPhase(NamedTuple):
    """Copies between views, other transfers, and the calls of each step."""

    copies: Sequence[tuple[memoryview, memoryview]]
    transfers: Sequence[TransferCall]
    steps: Iterable[Sequence[NumberedCall]]


class _DueSteps:
    """Iterable over the steps of a phase with several periods that are due now."""

    def __init__(
        self, steps: Sequence[Sequence[NumberedCall]], divisors: Sequence[int], marker: memoryview
    ):
        self._steps, self._divisors, self._marker = steps, divisors, marker

    def __iter__(self) -> Iterator[Sequence[NumberedCall]]:
        n = self._marker[STEP_COUNT]
        return compress(self._steps, [n % divisor == 0 for divisor in self._divisors])


class PythonExecutor(Executor):
    """Executor in pure Python."""

    def __init__(self, plan: Plan, recorder: Recorder, marker: np.ndarray | None = None):
        super().__init__(plan, recorder, marker)
        self._shortest_durations: dict[int, float] = {}

    def _prepare(self) -> None:
        self._phases = [
            self._compile_phase(phase, steps)
            for phase, steps in zip(self.plan.phases, self._schedule.phases, strict=True)
        ]
        self._exponents = [
            _exponent_bytes(floats) for floats in self._finite_check.monitored_floats
        ]

    def _compile_phase(self, phase: Phase, steps: Sequence[ScheduledStep]) -> _CompiledPhase:
        divisors = [step.step.divisor for step in steps]
        views = [contiguous_views(transfer) for transfer in phase.transfers]
        copies = list(chain.from_iterable(filter(None, views)))
        transfers = [
            self._transfer_call(t)
            for t, pairs in zip(phase.transfers, views, strict=True)
            if pairs is None
        ]
        calls = [self._number_calls(step) for step in steps]
        return _CompiledPhase(
            copies,
            transfers,
            calls if set(divisors) <= {1} else _DueSteps(calls, divisors, self.marker.data),
        )

    def _number_calls(self, step: ScheduledStep) -> list[NumberedCall]:
        measure = self._parallel_steps.has_candidates and self.completed_steps < MEASURED_STEPS
        functions = [
            self._with_timing(c, step.first_call)
            if measure and isinstance(c.native, NativeDoStep)
            else c.function
            for c in step.calls
        ]
        return [
            (step.first_call + i, f, c.arguments)
            for i, (f, c) in enumerate(zip(functions, step.calls, strict=True))
        ]

    def _with_timing(self, call: PreparedCall, first_call: int) -> Callable[..., int]:
        def timed(*arguments: Any) -> int:
            start = perf_counter()
            status = call.function(*arguments)
            duration = perf_counter() - start
            self._shortest_durations[first_call] = min(
                self._shortest_durations.get(first_call, inf), duration
            )
            return status

        return timed

    def _step_durations(self) -> dict[int, float]:
        return self._shortest_durations

    def _run_macro_steps(self, first: int, end: int) -> None:
        runner, marker, phases, exponents = (
            self._runner,
            self.marker.data,
            self._phases,
            self._exponents,
        )
        current_time, find_call = runner.current_time, self._schedule.find_call
        recorder, every = self.recorder, self.recorder.every
        one, little, least = float_mode.PROBE_VALUES
        stops = bool(self.stop_conditions)
        end = min(end, first + MAX_STEPS_PER_CALL)
        times = self.plan.grid.times(first, end + 1).tolist()
        for n, (time, next_time) in enumerate(pairwise(times), start=first):
            current_time.value = time
            for copies, transfers, steps in phases:
                for target, source in copies:
                    target[:] = source
                for transfer in transfers:
                    transfer()
                for calls in steps:
                    for marker[CALL_NUMBER], function, arguments in calls:
                        if (status := function(*arguments)) and status not in SUCCESS_STATUSES:
                            runner.handle_status(*find_call(marker[CALL_NUMBER]), status)
                    if one + little != one - little or not least + least:
                        self._restore_float_mode(calls[-1][0])
            if (termination := runner.termination) and not termination.complete:
                return
            for get_bytes, exponent_bytes in exponents:
                if 0x7F in (found := get_bytes()[exponent_bytes]) or 0xFF in found:
                    self._finite_check.run()
            if every == 1 or (n + 1) % every == 0:
                recorder.record(next_time)
                marker[ROW_COUNT] = recorder.row_count
                if stops:
                    self._check_stop_conditions(n + 1)
                    termination = runner.termination
            marker[STEP_COUNT] = n + 1
            if termination:
                return


def _exponent_bytes(floats: np.ndarray) -> tuple[Callable[[], bytes], slice]:
    """Return a function that returns bytes, and the slice with each float's upper exponent bits.

    A slice that contains neither 0x7F nor 0xFF has finite floats only. One of them also occurs for
    very large finite floats.
    """
    high_bytes = slice(
        floats.itemsize - 1 if sys.byteorder == "little" else 0, None, floats.itemsize
    )
    memory = floats.view(np.uint8)
    return (
        (memory.data.tobytes, high_bytes)
        if len(floats) < MIN_NUMPY_FLOATS
        else (memory[high_bytes].tobytes, slice(None))
    )
