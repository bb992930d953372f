"""Common base of Model Exchange instances: the importer integrates the states and handles the events."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ....core.component import PreparedCall, StepResult, Variable
from ....core.errors import ComponentError
from ....core.system import FLOAT_TYPES
from ..accessor_calls import AccessorCallFactory
from ..file import FmuFile
from ..function_calls import OK
from ..instance import FmuInstance
from ..instance_settings import InstanceSettings
from .continuous_model import ContinuousModel, IntegrationError
from .fixed_step import FixedStepIntegrator
from .integrator import EventKind, Integrator
from .linear_inputs import LinearInputs
from .variable_step import VariableStepIntegrator

#: largest number of calls of fmi*NewDiscreteStates or fmi3UpdateDiscreteStates at one event
MAX_EVENT_ITERATIONS = 1000
#: largest number of events in one communication step
MAX_EVENTS_PER_STEP = 10_000


class ModelState(NamedTuple):
    """Snapshot of an instance and of its integration; times in s."""

    fmu_state: Any
    time: float
    next_event_time: float


class ModelExchangeInstance(FmuInstance):
    """Base of the Model Exchange instances; the other base of a subclass is the Co-Simulation instance of the FMI version."""

    #: names of the C functions by role, see `ContinuousModel`
    _function_names: Mapping[str, str]
    #: name of FMPy's method that updates the discrete states
    _update_method: str

    def __init__(self, file: FmuFile, instance_name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        super().__init__(file, instance_name, settings)
        self._integrator: Integrator | None = None
        self._next_event_time, self._terminates = math.inf, False
        #: values of all bound inputs, and of those that change only at events, in the last step
        self._last_inputs: tuple[Any, Any] = (None, None)
        self._integration_call: PreparedCall | None = None
        self._step_duration = 0.0

    # -- life cycle ------------------------------------------------------------------------------------------------------

    def _prepare_transfers(self, factory: AccessorCallFactory) -> None:
        super()._prepare_transfers(factory)
        self._linear_inputs = LinearInputs(self._inputs, self.description.value_references)
        self._continuous_calls = factory.prepare("Set", self._inputs, self._set_object, _is_continuous)
        self._discrete_calls = factory.prepare("Set", self._inputs, self._set_object, _is_discrete)

    def _prepare_input_slopes(self, _factory: AccessorCallFactory) -> list[PreparedCall]:
        """Return no calls: the importer itself computes the values of linear inputs."""
        return []

    def exit_initialization_mode(self) -> None:
        """Call fmi*ExitInitializationMode, iterate the initial event and enter Continuous-Time Mode."""
        super().exit_initialization_mode()
        self._iterate_event()
        if self._terminates:
            reason = "the FMU requested termination in the initial event"
            raise ComponentError(self.name, self._full_name(self._update_method), reason, self._current_time.value)
        names = {role: self._c_prefix + name for role, name in self._function_names.items()}
        counts, completes = self._count_states(), self.description.needs_completed_step
        model = ContinuousModel(self.major, self._fmu.functions, self._handle, names, counts, completes, self._linear_inputs)
        self._integrator = self._create_integrator(model)
        self._restart(self._current_time.value)

    def _create_integrator(self, model: ContinuousModel) -> Integrator:
        settings, experiment = self._settings, self.description.default_experiment
        if settings.method == "cvode":
            return VariableStepIntegrator(model, settings.solver_tolerance(experiment))
        return FixedStepIntegrator(model, settings.method, settings.solver_step_size(experiment))

    def _count_states(self) -> tuple[int, int]:
        """Return the numbers of continuous states and event indicators."""
        return self.description.state_count, self.description.indicator_count

    def free(self) -> None:
        """Free the solver and the instance."""
        if self._integrator:
            self._integrator.close()
            self._integrator = None
        super().free()

    # -- events ----------------------------------------------------------------------------------------------------------

    def _iterate_event(self) -> None:
        """Update the discrete states until they are consistent, and enter Continuous-Time Mode.

        Raises:
            ComponentError: A call failed, or the iteration did not end.
        """
        for _ in range(MAX_EVENT_ITERATIONS):
            again, terminate, has_next, next_time = self._update_discrete_states()
            if has_next and math.isnan(next_time):
                reason = "the next time event is at NaN, expected a time in seconds"
                raise ComponentError(self.name, self._full_name(self._update_method), reason, self._current_time.value)
            self._next_event_time = next_time if has_next else math.inf
            if terminate:
                self._terminates = True
                return
            if not again:
                self._enter_mode("enterContinuousTimeMode")
                return
        reason = f"the event iteration did not end after {MAX_EVENT_ITERATIONS} calls"
        raise ComponentError(self.name, self._full_name(self._update_method), reason, self._current_time.value)

    def _update_discrete_states(self) -> tuple[bool, bool, bool, float]:
        """Update the discrete states once.

        Returns:
            Another update is needed, termination is requested, there is a next time event, and its time (s).
        """
        again, terminate, _, _, has_next, next_time = self.call_function(self._update_method)
        return again, terminate, has_next, next_time

    def _enter_mode(self, method: str) -> None:
        """Enter Event Mode or Continuous-Time Mode by FMPy's method."""
        self.call_function(method)

    def _handle_event(self, change: Callable[[], object] = lambda: None) -> None:
        """Handle an event at the present time of the integration; `change` sets variables in Event Mode."""
        assert self._integrator is not None
        self._enter_mode("enterEventMode")
        change()
        self._iterate_event()
        if not self._terminates:
            self._restart(self._integrator.time)

    def _restart(self, time: float) -> None:
        """Continue the integration after a discontinuity at `time` (s)."""
        assert self._integrator is not None
        with self._reporting_failures():
            self._integrator.restart(time, self._next_event_time)

    @contextmanager
    def _reporting_failures(self) -> Iterator[None]:
        """Convert the failure of a call in the block to a ComponentError."""
        try:
            yield
        except IntegrationError as error:
            if error.status is None:
                raise ComponentError(self.name, error.function, error.reason, self._current_time.value) from None
            raise self.status_error(error.function, error.status) from None

    # -- inputs ----------------------------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        """Set a variable; after the initialization, everything but continuous inputs is set in Event Mode."""
        variable = self._variables_by_name[name]
        if self._integrator is None:
            super().set(name, value)
        elif variable.causality == "input" and _is_continuous(variable):
            super().set(name, value)
            self._integrator.inputs_changed()
        else:
            self._handle_event(lambda: super(ModelExchangeInstance, self).set(name, value))

    def set_inputs(self) -> None:
        """Set all bound inputs, discrete ones in Event Mode if they have changed."""
        if self._integrator is None:
            super().set_inputs()
        else:
            self._apply_inputs()

    def _apply_inputs(self) -> int:
        """Set the bound inputs that have changed since the last step; discrete ones at an event."""
        assert self._integrator is not None
        discrete = [array[index].tolist() for array, index in self._discrete_elements]
        now = ([array.tolist() for array in self._inputs.arrays.values()], discrete)
        if now == self._last_inputs and not len(self._linear_inputs.slopes):
            return OK
        self._integrator.inputs_changed()
        if discrete == self._last_inputs[1]:
            self._execute_calls(self._continuous_calls)
        else:
            self._handle_event(lambda: self._execute_calls([*self._continuous_calls, *self._discrete_calls]))
        self._last_inputs = now
        return OK

    @cached_property
    def _discrete_elements(self) -> list[tuple[np.ndarray, slice]]:
        """Array and elements of each bound input that changes only at events."""
        elements, begins = [], dict.fromkeys(self._inputs.arrays, 0)
        for variable in self._inputs.variables:
            begin = begins[variable.dtype]
            begins[variable.dtype] += len(variable.scalar_names)
            if _is_discrete(variable):
                elements.append((self._inputs.arrays[variable.dtype], slice(begin, begins[variable.dtype])))
        return elements

    # -- steps -----------------------------------------------------------------------------------------------------------

    def prepare_step_calls(self, current_time: ctypes.c_double, step_size: float) -> Sequence[PreparedCall]:
        """Prepare the calls that set the inputs, integrate one step from `current_time` (s) and get the outputs."""
        self._current_time = current_time
        if not self._inputs.variables:
            inputs: Sequence[PreparedCall] = ()
        elif self._discrete_calls or self._settings.method == "cvode":
            inputs = [PreparedCall(self._apply_inputs, (), "inputs")]
        else:
            inputs = self._continuous_calls
        return [*inputs, self._prepare_integration(step_size), *self._get_calls]

    def _prepare_integration(self, step_size: float) -> PreparedCall:
        assert self._integrator is not None
        self._step_duration = step_size
        self._integration_call = self._integrator.prepare_step(self._current_time, step_size)
        return self._integration_call

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Integrate one communication step."""
        self._current_time.value = time
        return self._execute_calls([self._prepare_integration(step_size)])

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Handle the event at which the integration stopped, and integrate to the end of the step.

        Raises:
            ComponentError: A call failed, or the events do not end.
        """
        call, integrator = self._integration_call, self._integrator
        if call is None or integrator is None or function != call.name:
            raise self.status_error(function, status)
        for _ in range(MAX_EVENTS_PER_STEP):
            with self._reporting_failures():
                kind, time = integrator.take_event()
            if kind & EventKind.TERMINATION:
                return StepResult(time, terminate_requested=True)
            self._handle_event()
            if self._terminates:
                return StepResult(time, terminate_requested=True)
            if call.function(*call.arguments) == OK:
                return StepResult(self._current_time.value + self._step_duration)
        reason = f"more than {MAX_EVENTS_PER_STEP} events in one communication step, the last one at t = {time:.12g} s"
        raise ComponentError(self.name, function, reason, self._current_time.value)

    # -- states ----------------------------------------------------------------------------------------------------------

    def get_state(self) -> Any:
        """Return a snapshot of the FMU and of its integration."""
        assert self._integrator is not None
        return ModelState(super().get_state(), self._integrator.time, self._next_event_time)

    def set_state(self, state: Any) -> None:
        """Restore a snapshot."""
        super().set_state(state.fmu_state)
        self._next_event_time, self._last_inputs = state.next_event_time, (None, None)
        self._restart(state.time)

    def free_state(self, state: Any) -> None:
        """Free the FMU's part of a snapshot."""
        super().free_state(state.fmu_state)


def _is_continuous(variable: Variable) -> bool:
    return variable.variability == "continuous" and variable.type in FLOAT_TYPES and not variable.derivative_of


def _is_discrete(variable: Variable) -> bool:
    return not (_is_continuous(variable) or variable.derivative_of)
