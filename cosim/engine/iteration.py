"""Macro steps that are repeated until the components agree (fixed-point iteration with rollback).

In every round all components of a loop step from the same state; what they read is what the round before gave them, or this
round where a stage before theirs gave it. The last round's inputs therefore belong to the end of the step, not to its start.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from ..core.component import Component
from ..core.errors import ComponentError
from ..process.journal import calling
from .component_step import Turn, shown
from .layout import Dtype, Layout
from .plan import Loop
from .transfers import Move

#: the moves of a phase, those that are made in the first round only, and its turns
Round = tuple[Sequence[Move], Sequence[Move], Sequence[Turn]]


class Rounds:
    """The rounds of a loop's macro step; `take` takes a turn."""

    def __init__(self, loop: Loop, signals: Layout, phases: Sequence[Round], take: Callable[[Turn], None]):
        self._loop, self._phases, self._take = loop, phases, take
        self._components = loop.components
        outputs: dict[Dtype, dict[int, str]] = defaultdict(dict)
        for connection in loop.connections:
            slot = signals.places[connection.source]
            outputs[slot.dtype][slot.offset] = str(connection.source)
        self._watched = [(signals.arrays[dtype], list(found)) for dtype, found in outputs.items()]
        self._names = [list(found.values()) for found in outputs.values()]

    def step(self, time: float, try_again: Callable[[], None]) -> None:
        """The macro step from `time`; `try_again` forgets what components asked for in a round that is not the last one.

        Raises ComponentError when the outputs still change after the last round that is allowed.
        """
        with ExitStack() as stack:
            states = {name: self._state(name, component, time, stack) for name, component in self._components.items()}
            for number in range(self._loop.iteration.limit):
                if number:
                    try_again()
                    self._return_to(states, time)
                before = self._values()
                self._round(first=number == 0)
                moved = [self._moved(old, new) for old, new in zip(before, self._values(), strict=True)]
                if not any(flags.any() for flags in moved):
                    return
        raise ComponentError(self._loop.name, "iteration", self._complaint(moved), time)

    def _state(self, name: str, component: Component, time: float, stack: ExitStack) -> Any:
        """The component's state, which is freed with the stack."""
        with calling(name, "get_state", "step", time):
            state = component.get_state()

        def free() -> None:
            with calling(name, "free_state", "step", time):
                component.free_state(state)

        stack.callback(free)
        return state

    def _return_to(self, states: Mapping[str, Any], time: float) -> None:
        for name, state in states.items():
            with calling(name, "set_state", "step", time):
                self._components[name].set_state(state)

    def _round(self, first: bool) -> None:
        for moves, once, turns in self._phases:
            for move in (*moves, *once) if first else moves:
                move()
            for turn in turns:
                self._take(turn)

    def _values(self) -> list[np.ndarray]:
        return [array[places] for array, places in self._watched]

    def _moved(self, old: np.ndarray, new: np.ndarray) -> np.ndarray:
        if old.dtype.kind != "f":
            return old != new
        with np.errstate(invalid="ignore"):  # what is not finite never stands still
            return ~(np.abs(new - old) <= self._loop.iteration.tolerance * (1 + np.abs(new)))

    def _complaint(self, moved: Sequence[np.ndarray]) -> str:
        changing = [name for names, flags in zip(self._names, moved, strict=True) for name in np.array(names)[flags]]
        iteration = self._loop.iteration
        return (
            f"after {iteration.limit} rounds these outputs still change by more than {iteration.tolerance:g}: {shown(changing)}"
        )
