"""The pure Python executor: always available, C functions are called through ctypes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import compress
from math import inf
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..core.component import SUCCESS_STATUSES, NativeDoStep, PreparedCall
from ..process import float_mode
from ..process.journal import CALL_NUMBER, ROW_COUNT, STEP_COUNT
from .component_step import ScheduledStep
from .executor import Executor
from .parallel import MEASURED_STEPS
from .plan import Phase
from .transfer_calls import TransferCall, contiguous_views

#: from so many on it is numpy that picks bytes out of floats faster
MIN_NUMPY_FLOATS = 256

#: the number that goes into the marker, the function and its arguments
NumberedCall = tuple[int, Callable[..., int], tuple[Any, ...]]


class _CompiledPhase(NamedTuple):
    """What moves, and the calls of each turn."""

    copies: Sequence[tuple[memoryview, memoryview]]
    transfers: Sequence[TransferCall]
    steps: Iterable[Sequence[NumberedCall]]


class _DueSteps:
    """Those of the turns that are taken in the present macro step, for turns that are not all taken in every one."""

    def __init__(self, turns: Sequence[Sequence[NumberedCall]], divisors: Sequence[int], marker: memoryview):
        self._turns, self._divisors, self._marker = turns, divisors, marker

    def __iter__(self) -> Iterator[Sequence[NumberedCall]]:
        n = self._marker[STEP_COUNT]
        return compress(self._turns, [n % divisor == 0 for divisor in self._divisors])


class PythonExecutor(Executor):
    """The executor that needs no compiler: C functions are called through ctypes."""

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self._shortest_durations: dict[int, float] = {}

    def _prepare(self) -> None:
        self._phases = [
            self._compile_phase(phase, turns) for phase, turns in zip(self.plan.phases, self._phase_steps, strict=True)
        ]
        self._exponents = [_exponent_bytes(floats) for floats in self.monitored_floats]

    def _compile_phase(self, phase: Phase, turns: Sequence[ScheduledStep]) -> _CompiledPhase:
        divisors = [turn.step.divisor for turn in turns]
        copies = [piece for gather in phase.transfers for piece in contiguous_views(gather) or ()]
        moves = [self._transfer_call(gather) for gather in phase.transfers if contiguous_views(gather) is None]
        calls = [self._number_calls(turn) for turn in turns]
        return _CompiledPhase(copies, moves, calls if set(divisors) <= {1} else _DueSteps(calls, divisors, self.marker.data))

    def _number_calls(self, turn: ScheduledStep) -> list[NumberedCall]:
        measure = self._parallel_steps and self.completed_steps < MEASURED_STEPS
        functions = [
            self._with_timing(c, turn.first_call) if measure and isinstance(c.native, NativeDoStep) else c.function
            for c in turn.calls
        ]
        return [(turn.first_call + i, f, c.arguments) for i, (f, c) in enumerate(zip(functions, turn.calls, strict=True))]

    def _with_timing(self, call: PreparedCall, first: int) -> Callable[..., int]:
        def timed(*arguments: Any) -> int:
            began = perf_counter()
            status = call.function(*arguments)
            self._shortest_durations[first] = min(self._shortest_durations.get(first, inf), perf_counter() - began)
            return status

        return timed

    def _step_durations(self) -> dict[int, float]:
        return self._shortest_durations

    def _run_macro_steps(self, first: int, end: int) -> None:
        clock, marker, phases, exponents = self._current_time, self.marker.data, self._phases, self._exponents
        keepers, row, every = self.recorder.row_writers, self.recorder.row_count, self.recorder.every
        one, little, least = float_mode.PROBE_VALUES
        origin, stride, denominator = self.plan.grid.integer_coefficients.values()
        for n in range(first, end):
            clock.value = (origin + n * stride) / denominator
            for copies, moves, turns in phases:
                for target, source in copies:
                    target[:] = source
                for move in moves:
                    move()
                for calls in turns:
                    for marker[CALL_NUMBER], function, arguments in calls:
                        if (status := function(*arguments)) and status not in SUCCESS_STATUSES:
                            self._handle_status(*self._find_call(marker[CALL_NUMBER]), status)
                    if one + little != one - little or not least + least:
                        self._raise_float_mode_changed(*self._find_call(calls[-1][0]))
            if (termination := self.termination) and not termination.complete:
                return
            for contents, high in exponents:
                if 0x7F in (found := contents()[high]) or 0xFF in found:
                    self._check_finite()
            if every == 1 or (n + 1) % every == 0:
                for keep in keepers:
                    keep(row)
                row += 1
                marker[ROW_COUNT] = row
            marker[STEP_COUNT] = n + 1
            if termination:
                return


def _exponent_bytes(floats: np.ndarray) -> tuple[Callable[[], bytes], slice]:
    """Returns bytes, and where among them the sign and the upper seven bits of each exponent lie.

    0x7F or 0xFF is there when one of the floats is not finite, and when one is so large that looking closer does no harm.
    """
    every = slice(floats.itemsize - 1 if sys.byteorder == "little" else 0, None, floats.itemsize)
    memory = floats.view(np.uint8)
    return (memory.data.tobytes, every) if len(floats) < MIN_NUMPY_FLOATS else (memory[every].tobytes, slice(None))
