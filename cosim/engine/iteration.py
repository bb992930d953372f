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
from ..core.errors import ComponentError, abbreviate_names
from ..process.journal import calling_component
from .component_step import ScheduledStep
from .layout import Dtype, Layout
from .plan import Loop
from .transfer_calls import TransferCall

#: the moves of a phase, those that are made in the first round only, and its turns
IterationPhase = tuple[Sequence[TransferCall], Sequence[TransferCall], Sequence[ScheduledStep]]


class FixedPointIteration:
    """The rounds of a loop's macro step; `take` takes a turn."""

    def __init__(self, loop: Loop, signals: Layout, phases: Sequence[IterationPhase], run_step: Callable[[ScheduledStep], None]):
        self._loop, self._phases, self._run_step = loop, phases, run_step
        self._components = loop.components
        outputs: dict[Dtype, dict[int, str]] = defaultdict(dict)
        for connection in loop.connections:
            slot = signals.positions[connection.source]
            outputs[slot.dtype][slot.offset] = str(connection.source)
        self._coupled_outputs = [(signals.arrays[dtype], list(found)) for dtype, found in outputs.items()]
        self._output_names = [list(found.values()) for found in outputs.values()]

    def step(self, time: float, discard_requests: Callable[[], None]) -> None:
        """The macro step from `time`; `try_again` forgets what components asked for in a round that is not the last one.

        Raises ComponentError when the outputs still change after the last round that is allowed.
        """
        with ExitStack() as stack:
            states = {name: self._get_state(name, component, time, stack) for name, component in self._components.items()}
            for number in range(self._loop.iteration.max_rounds):
                if number:
                    discard_requests()
                    self._restore_states(states, time)
                before = self._output_values()
                self._iterate_once(first=number == 0)
                moved = [self._not_converged(old, new) for old, new in zip(before, self._output_values(), strict=True)]
                if not any(flags.any() for flags in moved):
                    return
        raise ComponentError(self._loop.name, "iteration", self._divergence_message(moved), time)

    def _get_state(self, name: str, component: Component, time: float, stack: ExitStack) -> Any:
        """The component's state, which is freed with the stack."""
        with calling_component(name, "get_state", "step", time):
            state = component.get_state()

        def free() -> None:
            with calling_component(name, "free_state", "step", time):
                component.free_state(state)

        stack.callback(free)
        return state

    def _restore_states(self, states: Mapping[str, Any], time: float) -> None:
        for name, state in states.items():
            with calling_component(name, "set_state", "step", time):
                self._components[name].set_state(state)

    def _iterate_once(self, first: bool) -> None:
        for moves, once, turns in self._phases:
            for move in (*moves, *once) if first else moves:
                move()
            for turn in turns:
                self._run_step(turn)

    def _output_values(self) -> list[np.ndarray]:
        return [array[places] for array, places in self._coupled_outputs]

    def _not_converged(self, old: np.ndarray, new: np.ndarray) -> np.ndarray:
        if old.dtype.kind != "f":
            return old != new
        with np.errstate(invalid="ignore"):  # what is not finite never stands still
            return ~(np.abs(new - old) <= self._loop.iteration.tolerance * (1 + np.abs(new)))

    def _divergence_message(self, moved: Sequence[np.ndarray]) -> str:
        changing = [name for names, flags in zip(self._output_names, moved, strict=True) for name in np.array(names)[flags]]
        iteration = self._loop.iteration
        names = abbreviate_names(changing)
        return f"after {iteration.max_rounds} rounds these outputs still change by more than {iteration.tolerance:g}: {names}"
