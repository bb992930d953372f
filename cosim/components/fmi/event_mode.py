"""Event Mode of FMU instances.

Iteration of the discrete states, and discrete inputs, which change at events only.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ...core.compatibility import FLOAT_TYPES
from ...core.component import Variable
from ...core.errors import ComponentError
from .accessor_calls import AccessorCallFactory
from .file import FmuFile
from .function_calls import OK
from .instance import FmuInstance
from .settings import InstanceSettings

#: largest number of calls of fmi*NewDiscreteStates or fmi3UpdateDiscreteStates at one event
MAX_EVENT_ITERATIONS = 1000
#: largest number of events in one communication step
MAX_EVENTS_PER_STEP = 10_000


class EventModeInstance(FmuInstance):
    """Base of the instances with Event Mode.

    Another base of a subclass is the Co-Simulation instance of the FMI version.
    """

    #: name of FMPy's method that updates the discrete states
    _update_method: str
    #: name of FMPy's method that ends an event
    _continue_method: str

    def __init__(self, file: FmuFile, instance_name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        super().__init__(file, instance_name, settings)
        self._next_event_time, self._terminates = math.inf, False
        #: values of all bound inputs, and of those that change only at events, in the last step
        self._last_inputs: tuple[Any, Any] = (None, None)

    # -- what differs between the interfaces
    # -----------------------------------------------------------------------------

    @property
    def _is_stepping(self) -> bool:
        """True after the initialization, if the FMU has Event Mode."""
        raise NotImplementedError

    def _handle_event(self, change: Callable[[], object] = lambda: None) -> None:
        """Handle an event at the present time; `change` sets variables in Event Mode."""
        self._enter_mode("enterEventMode")
        change()
        self._iterate_event()

    def _continuous_inputs_changed(self) -> None:
        """Take into account that continuous inputs are not those of the last step."""

    # -- events
    # ----------------------------------------------------------------------------------------------------------

    def _iterate_initial_event(self) -> None:
        """Iterate the event at the end of the initialization.

        Raises:
            ComponentError: A call failed, the iteration did not end, or the FMU requested
                termination.
        """
        self._iterate_event()
        if self._terminates:
            raise self._update_error("the FMU requested termination in the initial event")

    def _iterate_event(self) -> None:
        """Update the discrete states until they are consistent, and leave Event Mode.

        Raises:
            ComponentError: A call failed, or the iteration did not end.
        """
        for _ in range(MAX_EVENT_ITERATIONS):
            again, terminate, has_next, next_time = self._update_discrete_states()
            if has_next and math.isnan(next_time):
                raise self._update_error(
                    "the next time event is at NaN, expected a time in seconds"
                )
            self._next_event_time = next_time if has_next else math.inf
            if terminate:
                self._terminates = True
                return
            if not again:
                self._enter_mode(self._continue_method)
                return
        raise self._update_error(
            f"the event iteration did not end after {MAX_EVENT_ITERATIONS} calls"
        )

    def _update_error(self, reason: str) -> ComponentError:
        return ComponentError(
            self.name, self._full_name(self._update_method), reason, self._current_time.value
        )

    def _update_discrete_states(self) -> tuple[bool, bool, bool, float]:
        """Update the discrete states once.

        Returns:
            Another update is needed, termination is requested, there is a next time event, and its
            time (s).
        """
        again, terminate, _, _, has_next, next_time = self.call_function(self._update_method)
        return again, terminate, has_next, next_time

    def _enter_mode(self, method: str) -> None:
        """Enter a mode by FMPy's method."""
        self.call_function(method)

    # -- inputs
    # ----------------------------------------------------------------------------------------------------------

    def _prepare_transfers(self, factory: AccessorCallFactory) -> None:
        super()._prepare_transfers(factory)
        self._continuous_calls = factory.prepare(
            "Set", self._inputs, self._set_object, is_continuous
        )
        self._discrete_calls = factory.prepare("Set", self._inputs, self._set_object, is_discrete)

    def set(self, name: str, value: Any) -> None:
        """Set a variable; after the initialization, everything but continuous inputs is set in Event Mode."""
        variable = self._variables_by_name[name]
        if not self._is_stepping:
            super().set(name, value)
        elif variable.causality == "input" and is_continuous(variable):
            super().set(name, value)
            self._continuous_inputs_changed()
        else:
            self._handle_event(lambda: super(EventModeInstance, self).set(name, value))

    def set_inputs(self) -> None:
        """Set all bound inputs, discrete ones in Event Mode if they have changed."""
        if self._is_stepping:
            self._apply_inputs()
        else:
            super().set_inputs()

    def _apply_inputs(self) -> int:
        """Set the bound inputs that have changed since the last step; discrete ones at an event."""
        discrete = [array[index].tolist() for array, index in self._discrete_elements]
        now = ([array.tolist() for array in self._inputs.arrays.values()], discrete)
        if now == self._last_inputs and not self._interpolates_bound_inputs:
            return OK
        self._continuous_inputs_changed()
        if discrete == self._last_inputs[1]:
            self._execute_calls(self._continuous_calls)
        else:
            self._handle_event(
                lambda: self._execute_calls([*self._continuous_calls, *self._discrete_calls])
            )
        self._last_inputs = now
        return OK

    @cached_property
    def _interpolates_bound_inputs(self) -> bool:
        """True if an input changes within a step, so that its value of the begin has to be set again."""
        return any(variable.derivative_of for variable in self._inputs.variables)

    @cached_property
    def _discrete_elements(self) -> list[tuple[np.ndarray, slice]]:
        """Array and elements of each bound input that changes only at events."""
        elements, begins = [], dict.fromkeys(self._inputs.arrays, 0)
        for variable in self._inputs.variables:
            begin = begins[variable.dtype]
            begins[variable.dtype] += len(variable.scalar_names)
            if is_discrete(variable):
                elements.append(
                    (self._inputs.arrays[variable.dtype], slice(begin, begins[variable.dtype]))
                )
        return elements


def is_continuous(variable: Variable) -> bool:
    """Return whether an input may be set outside of Event Mode."""
    return (
        variable.variability == "continuous"
        and variable.type in FLOAT_TYPES
        and not variable.derivative_of
    )


def is_discrete(variable: Variable) -> bool:
    """Return whether an input is set in Event Mode."""
    return not (is_continuous(variable) or variable.derivative_of)
