"""Saved states of a simulation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from typing import Any
from weakref import finalize

from ..core.component import Component
from ..core.errors import InputError, abbreviate_names
from .executor import ExecutorState

#: returns a block in which a function of a component is called, from the names of both
Access = Callable[[str, str], AbstractContextManager[None]]


class ComponentState:
    """State of each component by its name.

    The memory in the components is released after the last reference is gone.
    """

    def __init__(self, states: Mapping[str, Any]):
        self.states = states


@dataclass(frozen=True, eq=False)
class SavedState:
    """State of a simulation at a communication point.

    Attributes:
        owner: the simulation's saved states.
        executor: state of the executor.
        components: state of the components.
    """

    owner: ComponentStates = field(repr=False)
    executor: ExecutorState = field(repr=False)
    components: ComponentState = field(repr=False)


class ComponentStates:
    """All states that were saved of the components of a simulation.

    A state that is garbage-collected is freed with the next call only, because a component may be
    stepping meanwhile.
    """

    def __init__(self, components: Mapping[str, Component], access: Access):
        self._components, self._access = components, access
        self._saved: dict[int, Mapping[str, Any]] = {}
        self._discarded: list[int] = []

    def __len__(self) -> int:
        """Return the number of saved states."""
        return len(self._saved)

    def save(self) -> ComponentState:
        """Save the present state of all components.

        Raises:
            InputError: a component cannot return to a state.
            ComponentError: a component failed.
        """
        if unable := [
            name for name, component in self._components.items() if not component.has_state
        ]:
            verb = "cannot return to a state (FMI: canGetAndSetFMUState)"
            raise InputError(
                f"the state of the simulation cannot be saved: {abbreviate_names(unable)} {verb}"
            )
        self._free_discarded()
        states: dict[str, Any] = {}
        saved = ComponentState(states)
        self._saved[id(states)] = states
        finalize(saved, self._discarded.append, id(states)).atexit = False
        for name, component in self._components.items():
            with self._access(name, "get_state"):
                states[name] = component.get_state()
        return saved

    def restore(self, saved: ComponentState) -> None:
        """Return all components to a saved state.

        Raises:
            ComponentError: a component failed.
        """
        self._free_discarded()
        for name, state in saved.states.items():
            with self._access(name, "set_state"):
                self._components[name].set_state(state)

    def free_all(self) -> None:
        """Release the memory of all states, before the components are freed."""
        self._discarded = list(self._saved)
        self._free_discarded()

    def _free_discarded(self) -> None:
        while self._discarded:
            for name, state in self._saved.pop(self._discarded.pop()).items():
                with self._access(name, "free_state"):
                    self._components[name].free_state(state)
