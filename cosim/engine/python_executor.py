"""The pure Python executor: always available, C functions are called through ctypes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import compress
from math import inf
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from ..core.component import GOOD, Call, DoStep
from ..process import float_mode
from .component_step import Turn
from .executor import CALL, ROWS, STEPS, Executor
from .parallel import TRIALS
from .plan import Phase
from .transfers import Move, pieces

#: from so many on it is numpy that picks bytes out of floats faster
MANY_FLOATS = 256

#: the number that goes into the marker, the function and its arguments
NumberedCall = tuple[int, Callable[..., int], tuple[Any, ...]]


class _Phase(NamedTuple):
    """What moves, and the calls of each turn."""

    copies: Sequence[tuple[memoryview, memoryview]]
    moves: Sequence[Move]
    turns: Iterable[Sequence[NumberedCall]]


class _Due:
    """Those of the turns that are taken in the present macro step, for turns that are not all taken in every one."""

    def __init__(self, turns: Sequence[Sequence[NumberedCall]], divisors: Sequence[int], marker: memoryview):
        self._turns, self._divisors, self._marker = turns, divisors, marker

    def __iter__(self) -> Iterator[Sequence[NumberedCall]]:
        n = self._marker[STEPS]
        return compress(self._turns, [n % divisor == 0 for divisor in self._divisors])


class PythonExecutor(Executor):
    """The executor that needs no compiler: C functions are called through ctypes."""

    def __init__(self, *arguments: Any, **named: Any):
        super().__init__(*arguments, **named)
        self._shortest: dict[int, float] = {}

    def _prepare(self) -> None:
        self._phases = [self._phase(phase, turns) for phase, turns in zip(self.plan.phases, self._stages, strict=True)]
        self._exponents = [_exponents(floats) for floats in self.watched]

    def _phase(self, phase: Phase, turns: Sequence[Turn]) -> _Phase:
        divisors = [turn.step.divisor for turn in turns]
        copies = [piece for gather in phase.gathers for piece in pieces(gather) or ()]
        moves = [self._move(gather) for gather in phase.gathers if pieces(gather) is None]
        calls = [self._numbered(turn) for turn in turns]
        return _Phase(copies, moves, calls if set(divisors) <= {1} else _Due(calls, divisors, self.marker.data))

    def _numbered(self, turn: Turn) -> list[NumberedCall]:
        measure = self._joint and self.finished < TRIALS
        functions = [self._timed(c, turn.first) if measure and isinstance(c.native, DoStep) else c.function for c in turn.calls]
        return [(turn.first + i, f, c.arguments) for i, (f, c) in enumerate(zip(functions, turn.calls, strict=True))]

    def _timed(self, call: Call, first: int) -> Callable[..., int]:
        def timed(*arguments: Any) -> int:
            began = perf_counter()
            status = call.function(*arguments)
            self._shortest[first] = min(self._shortest.get(first, inf), perf_counter() - began)
            return status

        return timed

    def _measured(self) -> dict[int, float]:
        return self._shortest

    def _steps(self, first: int, end: int) -> None:
        clock, marker, phases, exponents = self._clock, self.marker.data, self._phases, self._exponents
        keepers, row, every = self.recorder.keepers, self.recorder.rows, self.recorder.every
        one, little, least = float_mode.PROBE
        origin, stride, denominator = self.plan.grid.integers.values()
        for n in range(first, end):
            clock.value = (origin + n * stride) / denominator
            for copies, moves, turns in phases:
                for target, source in copies:
                    target[:] = source
                for move in moves:
                    move()
                for calls in turns:
                    for marker[CALL], function, arguments in calls:
                        if (status := function(*arguments)) and status not in GOOD:
                            self._bad_status(*self._turn_of(marker[CALL]), status)
                    if one + little != one - little or not least + least:
                        self._float_state_changed(*self._turn_of(calls[-1][0]))
            if (termination := self.termination) and not termination.complete:
                return
            for contents, high in exponents:
                if 0x7F in (found := contents()[high]) or 0xFF in found:
                    self._check_finite()
            if every == 1 or (n + 1) % every == 0:
                for keep in keepers:
                    keep(row)
                row += 1
                marker[ROWS] = row
            marker[STEPS] = n + 1
            if termination:
                return


def _exponents(floats: np.ndarray) -> tuple[Callable[[], bytes], slice]:
    """Returns bytes, and where among them the sign and the upper seven bits of each exponent lie.

    0x7F or 0xFF is there when one of the floats is not finite, and when one is so large that looking closer does no harm.
    """
    every = slice(floats.itemsize - 1 if sys.byteorder == "little" else 0, None, floats.itemsize)
    memory = floats.view(np.uint8)
    return (memory.data.tobytes, every) if len(floats) < MANY_FLOATS else (memory[every].tobytes, slice(None))
