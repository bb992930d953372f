"""Model Exchange of FMUs: the importer integrates the states and handles the events."""

import ctypes
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from ....core.component import PreparedCall, StepResult
from ..accessor_calls import AccessorCallFactory
from ..api import OK
from ..driver import MAX_EVENTS_PER_STEP, EventMode, FmuDriver
from .continuous_model import (
    ContinuousModel,
    EventKind,
    IntegrationError,
    Integrator,
    LinearInputs,
)
from .fixed_step import FixedStepIntegrator
from .variable_step import VariableStepIntegrator


class ModelExchangeState(NamedTuple):
    """Snapshot of an instance and of its integration; times in s."""

    fmu_state: Any
    time: float
    next_event_time: float


class ModelExchangeFmu(FmuDriver):
    """Component of a Model Exchange FMU.

    Each step is integrated from event to event.
    """

    _integrator: Integrator | None = None
    _integration_call: PreparedCall | None = None
    #: length (s) of the step that is being made
    _step_size = 0.0

    def _prepare_linear_inputs(self, _factory: AccessorCallFactory) -> None:
        """Find the linear inputs, whose values the importer itself computes."""
        self._linear_inputs = LinearInputs(self._inputs, self.description.value_references)

    def exit_initialization_mode(self) -> None:
        """Exit the initialization mode, iterate the initial event and start the integration."""
        self._end_initialization()
        events = self._start_event_mode(
            "enterContinuousTimeMode", self._event_handled, self._continuous_inputs_changed
        )
        api, settings, experiment = self.api, self._settings, self.description.default_experiment
        model = ContinuousModel(
            api.major,
            api.functions,
            api.handle,
            {role: api.c_prefix + name for role, name in api.model_functions.items()},
            api.count_states(),
            self.description.needs_completed_step,
            self._linear_inputs,
        )
        if settings.method == "cvode":
            tolerance = settings.solver_tolerance(experiment)
            self._integrator = VariableStepIntegrator(model, tolerance)
        else:
            step_size = settings.solver_step_size(experiment)
            self._integrator = FixedStepIntegrator(model, settings.method, step_size)
        self._event_mode = events
        self._restart(api.current_time.value)

    def free(self) -> None:
        """Free the solver and the instance."""
        if self._integrator:
            self._integrator.close()
            self._integrator = self._event_mode = None
        self.api.free()

    # -- events

    @property
    def _running(self) -> tuple[Integrator, EventMode]:
        """Integrator and Event Mode, which exist after the initialization."""
        assert self._integrator is not None
        assert self._event_mode is not None
        return self._integrator, self._event_mode

    def _continuous_inputs_changed(self) -> None:
        self._running[0].inputs_changed()

    def _event_handled(self) -> None:
        integrator, events = self._running
        if not events.terminates:
            self._restart(integrator.time)

    def _restart(self, time: float) -> None:
        """Continue the integration after a discontinuity at `time` (s)."""
        integrator, events = self._running
        with self._reporting_failures():
            integrator.restart(time, events.next_event_time)

    @contextmanager
    def _reporting_failures(self) -> Iterator[None]:
        """Convert the failure of a call in the block to a ComponentError."""
        try:
            yield
        except IntegrationError as error:
            if error.status is None:
                raise self.api.error(error.function, error.reason) from None
            raise self.api.status_error(error.function, error.status) from None

    # -- steps

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Prepare the calls that set the inputs, integrate one step and get the outputs."""
        self.api.current_time = current_time
        integrator, events = self._running
        inputs: Sequence[PreparedCall] = ()
        if self._inputs.variables:
            inputs = events.continuous_calls
            if events.discrete_calls or integrator.needs_input_changes:
                inputs = [PreparedCall(events.apply_inputs, (), "inputs")]
        return [*inputs, self._prepare_integration(step_size), *self._get_calls]

    def _prepare_integration(self, step_size: float) -> PreparedCall:
        self._step_size = step_size
        integrator, _ = self._running
        self._integration_call = integrator.prepare_step(self.api.current_time, step_size)
        return self._integration_call

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Integrate one communication step."""
        self.api.current_time.value = time
        return self.api.execute([self._prepare_integration(step_size)], self.interpret_status)

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Handle the event at which the integration stopped, and integrate to the end of the step.

        Raises:
            ComponentError: A call failed, or the events do not end.
        """
        call = self._integration_call
        if call is None or function != call.name:
            raise self.api.status_error(function, status)
        integrator, events = self._running
        for _ in range(MAX_EVENTS_PER_STEP):
            with self._reporting_failures():
                kind, time = integrator.take_event()
            if kind & EventKind.TERMINATION:
                return StepResult(time, terminate_requested=True)
            events.handle()
            if events.terminates:
                return StepResult(time, terminate_requested=True)
            if call.function(*call.arguments) == OK:
                return StepResult(self.api.current_time.value + self._step_size)
        reason = (
            f"more than {MAX_EVENTS_PER_STEP} events in one communication step, the last one at t "
            f"= {time:.12g} s"
        )
        raise self.api.error(function, reason)

    # -- states

    def get_state(self) -> Any:
        """Return a snapshot of the FMU and of its integration."""
        integrator, events = self._running
        return ModelExchangeState(self.api.get_state(), integrator.time, events.next_event_time)

    def set_state(self, state: ModelExchangeState) -> None:
        """Restore a snapshot."""
        self.api.set_state(state.fmu_state)
        _, events = self._running
        events.next_event_time, events.last_inputs = state.next_event_time, (None, None)
        self._restart(state.time)

    def free_state(self, state: ModelExchangeState) -> None:
        """Free the FMU's part of a snapshot."""
        self.api.free_state(state.fmu_state)
