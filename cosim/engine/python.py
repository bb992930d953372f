"""The pure Python executor: always available, C functions are called through ctypes."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import inf
from time import perf_counter
from typing import Any

import numpy as np

from ..component import GOOD, Call, DoStep
from .executor import CALL, ROWS, STEPS, Executor
from .parallel import TRIALS
from .turns import Turn

#: up to so many are faster added one by one than by numpy
FEW_FLOATS = 16


class PythonExecutor(Executor):
    """The executor that needs no compiler: C functions are called through ctypes."""

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self._shortest: dict[int, float] = {}

    def _prepare(self) -> None:
        self._phases = [
            ([self._move(gather) for gather in phase.gathers], [self._numbered(turn) for turn in turns])
            for phase, turns in zip(self.plan.phases, self._stages, strict=True)
        ]
        self._spoiled = [_spoiled(floats) for floats in self.watched]

    def _numbered(self, turn: Turn) -> tuple[int, list[tuple[Any, Any, int]], Turn]:
        measure = self._joint and self.finished < TRIALS
        functions = [self._timed(c, turn.first) if measure and isinstance(c.native, DoStep) else c.function for c in turn.calls]
        calls = [(f, c.arguments, turn.first + i) for i, (f, c) in enumerate(zip(functions, turn.calls, strict=True))]
        return turn.step.divisor, calls, turn

    def _timed(self, call: Call, first: int) -> Callable[..., int]:
        def timed(*arguments: Any) -> int:
            began = perf_counter()
            status = call.function(*arguments)
            self._shortest[first] = min(self._shortest.get(first, inf), perf_counter() - began)
            return status

        return timed

    def _measured(self) -> dict[int, float]:
        return self._shortest

    def _run(self, end: int) -> None:
        grid, phases, record, clock = self.plan.grid, self._phases, self.recorder.record, self._clock
        origin, stride, denominator = grid.integers.values()
        marker, recorder, checks = self.marker.data, self.recorder, self._spoiled
        # equal in the default rounding mode only, and the least denormal is no zero only if it is not flushed
        one, little, least = 1.0, 2.0**-54, 5e-324
        for n in range(self.finished, end):
            clock.value = (origin + n * stride) / denominator
            for moves, turns in phases:
                for move in moves:
                    move()
                for divisor, calls, turn in turns:
                    if divisor != 1 and n % divisor:
                        continue
                    for function, arguments, number in calls:
                        marker[CALL] = number
                        if (status := function(*arguments)) and status not in GOOD:
                            self._bad_status(turn, turn.calls[number - turn.first], status)
                            break
                    if one + little != one - little or not least + least:
                        self._float_state_changed(turn, turn.calls[-1])
            for spoiled in checks:
                if spoiled():
                    self._check_finite()
            record(n + 1)
            marker[ROWS], marker[STEPS] = recorder.rows, n + 1
            if self.termination:
                return


def _spoiled(floats: np.ndarray) -> Callable[[], float]:
    """Zero when all are finite, otherwise NaN; it may be NaN too when their sum is not finite."""
    if len(floats) <= FEW_FLOATS:
        view = floats.data
        return lambda: sum(view) * 0.0
    zeros: Any = np.zeros_like(floats)
    return partial(floats.dot, zeros)  # type: ignore[return-value]
