"""Components of FMUs, and what Co-Simulation and Model Exchange have in common."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...core.component import Component, Ports, PreparedCall, Variable
from ...core.system import FLOAT_TYPES
from .accessor_calls import AccessorCallFactory, prepare_negations
from .api import OK, FmiApi
from .file import FmuFile
from .settings import InstanceSettings
from .versions import create_api

#: largest number of calls of fmi*NewDiscreteStates or fmi3UpdateDiscreteStates at one event
MAX_EVENT_ITERATIONS = 1000
#: largest number of events in one communication step
MAX_EVENTS_PER_STEP = 10_000
#: attributes of a component that its model description has too
_DESCRIBED = (
    "variables",
    "has_state",
    "variable_step",
    "continuous_states",
    "dependencies",
    "initial_dependencies",
    "interpolates_inputs",
    "gives_output_slopes",
)


class FmuComponent(Component):
    """Component of one instance of an FMU.

    Attributes:
        name: Name of the instance.
        description: Model description of the FMU, with the sizes of the instance's arrays.
    """

    binds_everything = False
    variables: Sequence[Variable]
    has_state: bool

    def __init__(self, file: FmuFile, name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        file.check_binary()
        self.name, self._file, self._settings = name, file, settings
        self.description = file.description.with_structural_parameters(
            settings.structural_parameters
        )
        for attribute in _DESCRIBED:
            setattr(self, attribute, getattr(self.description, attribute))
        self._variables_by_name = {variable.name: variable for variable in self.variables}


class FmuDriver(FmuComponent):
    """Component that calls the C functions of an FMU instance in the importer's process.

    Attributes:
        api: The C functions of the instance.
    """

    def __init__(self, file: FmuFile, name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        super().__init__(file, name, settings)
        self.shared_code = file
        self.api = create_api(file, self.description, name, settings)
        #: Event Mode of the instance after its initialization; None if it has none
        self._event_mode: EventMode | None = None

    @abstractmethod
    def _prepare_linear_inputs(self, factory: AccessorCallFactory) -> None:
        """Prepare the inputs that change linearly within a step."""

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Store the arrays; `instantiate` prepares the calls that transfer them."""
        self._inputs, self._outputs = inputs, outputs

    def instantiate(self) -> None:
        """Instantiate the FMU, and prepare the calls that transfer the bound arrays.

        Raises:
            InputError: The library cannot be loaded.
            ComponentError: The FMU returned no instance.
        """
        self.api.instantiate()
        factory = self.api.accessor_calls()
        self._set_calls = factory.prepare("Set", self._inputs, self._set_object, is_value)
        self._prepare_linear_inputs(factory)
        self._get_calls = factory.prepare("Get", self._outputs, self._get_object, is_value)
        self._get_calls += prepare_negations(self._outputs, self.description.negated)
        self._output_slope_calls = factory.prepare(
            "Get", self._outputs, self._get_object, lambda variable: not is_value(variable)
        )

    def _set_object(self, name: str, array: np.ndarray, index: int) -> int:
        self.api.set(name, array[index])
        return OK

    def _get_object(self, name: str, array: np.ndarray, index: int) -> int:
        array[index] = self.api.get(name)
        return OK

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Set up the experiment and enter the initialization mode; times in s."""
        self.api.enter_initialization(start_time, stop_time)

    def _end_initialization(self) -> None:
        """Exit the initialization mode; from now on outputs have time derivatives."""
        self.api.exit_initialization()
        self.api.enter_stepping()
        self._get_calls += self._output_slope_calls

    def _start_event_mode(
        self,
        continue_method: str,
        handled: Callable[[], None] = lambda: None,
        inputs_changed: Callable[[], None] = lambda: None,
    ) -> EventMode:
        """Handle the initial event, and return the Event Mode of the instance; see `EventMode`."""
        factory = self.api.accessor_calls()
        calls = [
            factory.prepare("Set", self._inputs, self._set_object, selected)
            for selected in (is_continuous, is_discrete)
        ]
        events = EventMode(self.api, self._inputs, calls, continue_method, handled, inputs_changed)
        events.iterate_initial()
        return events

    def set(self, name: str, value: Any) -> None:
        """Set a variable; after the initialization, all but continuous inputs in Event Mode."""
        events, variable = self._event_mode, self._variables_by_name[name]
        if events is None:
            self.api.set(name, value)
        elif variable.causality == "input" and is_continuous(variable):
            self.api.set(name, value)
            events.inputs_changed()
        else:
            events.handle(lambda: self.api.set(name, value))

    def get(self, name: str) -> Any:
        """Return the value of a variable."""
        return self.api.get(name)

    def set_inputs(self) -> None:
        """Set all bound inputs, discrete ones in Event Mode if they have changed."""
        if self._event_mode:
            self._event_mode.apply_inputs()
        else:
            self.api.execute(self._set_calls)

    def get_outputs(self) -> None:
        """Get all bound outputs."""
        self.api.execute(self._get_calls)

    def get_directional_derivative(
        self, outputs: Sequence[str], input_name: str
    ) -> Sequence[float] | None:
        """Return the directional derivatives of outputs; None if the FMU does not offer them."""
        return self.api.get_directional_derivative(outputs, input_name)

    def terminate(self) -> None:
        """Call fmi*Terminate, unless an instance of the FMU has returned fatal."""
        self.api.terminate()


class EventMode:
    """Event Mode of an instance.

    It iterates the discrete states, and sets discrete inputs, which change at events only.

    Attributes:
        discrete_calls: Prepared calls that set the discrete inputs.
        continuous_calls: Prepared calls that set the continuous inputs.
        inputs_changed: Called when continuous inputs are not those of the last step.
        last_inputs: Values of all bound inputs, and of the discrete ones, in the last step.
        next_event_time: Time of the next time event (s); infinity if there is none.
        terminates: The FMU has requested termination.
    """

    def __init__(
        self,
        api: FmiApi,
        inputs: Ports,
        calls: Sequence[Sequence[PreparedCall]],
        continue_method: str,
        handled: Callable[[], None],
        inputs_changed: Callable[[], None],
    ):
        """Prepare the handling of events.

        Args:
            api: C functions of the instance, whose initialization has ended.
            inputs: Bound inputs.
            calls: Prepared calls that set the continuous inputs, and those for the discrete ones.
            continue_method: Name of FMPy's method that ends an event.
            handled: Called after each event but the initial one.
            inputs_changed: See above.
        """
        self._api, self._inputs, self._continue_method = api, inputs, continue_method
        self.continuous_calls, self.discrete_calls = calls
        self._handled, self.inputs_changed = handled, inputs_changed
        self.last_inputs: tuple[Any, Any] = (None, None)
        self.next_event_time, self.terminates = math.inf, False
        #: an input changes within a step, so that its value of the begin has to be set again
        self._interpolates = any(variable.derivative_of for variable in inputs.variables)
        #: array and elements of each discrete input
        self._discrete_elements = [
            (array, part) for variable, array, part in inputs.elements() if is_discrete(variable)
        ]

    def handle(self, change: Callable[[], object] = lambda: None) -> None:
        """Handle an event at the present time; `change` sets variables in Event Mode."""
        self._api.enter_mode("enterEventMode")
        change()
        self._iterate()
        self._handled()

    def iterate_initial(self) -> None:
        """Iterate the event at the end of the initialization.

        Raises:
            ComponentError: A call failed, the iteration did not end, or the FMU requested
                termination.
        """
        self._iterate()
        if self.terminates:
            raise self._error("the FMU requested termination in the initial event")

    def _iterate(self) -> None:
        """Update the discrete states until they are consistent, and leave Event Mode.

        Raises:
            ComponentError: A call failed, or the iteration did not end.
        """
        for _ in range(MAX_EVENT_ITERATIONS):
            again, terminate, has_next, next_time = self._api.update_discrete_states()
            if has_next and math.isnan(next_time):
                raise self._error("the next time event is at NaN, expected a time in seconds")
            self.next_event_time = next_time if has_next else math.inf
            if terminate:
                self.terminates = True
                return
            if not again:
                self._api.enter_mode(self._continue_method)
                return
        raise self._error(f"the event iteration did not end after {MAX_EVENT_ITERATIONS} calls")

    def _error(self, reason: str) -> Exception:
        return self._api.error(self._api.full_name(self._api.update_method), reason)

    def apply_inputs(self) -> int:
        """Set the bound inputs that have changed since the last step; discrete ones at an event."""
        discrete = [array[part].tolist() for array, part in self._discrete_elements]
        now = ([array.tolist() for array in self._inputs.arrays.values()], discrete)
        if now == self.last_inputs and not self._interpolates:
            return OK
        self.inputs_changed()
        if discrete == self.last_inputs[1]:
            self._api.execute(self.continuous_calls)
        else:
            calls = [*self.continuous_calls, *self.discrete_calls]
            self.handle(lambda: self._api.execute(calls))
        self.last_inputs = now
        return OK


def is_value(variable: Variable) -> bool:
    """Return whether a bound variable is not the time derivative of another one."""
    return not variable.derivative_of


def is_continuous(variable: Variable) -> bool:
    """Return whether an input may be set outside of Event Mode."""
    is_float = variable.variability == "continuous" and variable.type in FLOAT_TYPES
    return is_float and is_value(variable)


def is_discrete(variable: Variable) -> bool:
    """Return whether an input is set in Event Mode."""
    return is_value(variable) and not is_continuous(variable)
