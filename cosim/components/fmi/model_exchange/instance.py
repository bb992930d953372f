"""Common base of Model Exchange instances.

The importer integrates the states and handles the events.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from ....core.component import PreparedCall, StepResult
from ....core.errors import ComponentError
from ..accessor_calls import AccessorCallFactory
from ..event_mode import MAX_EVENTS_PER_STEP, EventModeInstance
from ..file import FmuFile
from ..function_calls import OK
from ..settings import InstanceSettings
from .continuous_model import ContinuousModel, EventKind, IntegrationError, Integrator, LinearInputs
from .fixed_step import FixedStepIntegrator
from .variable_step import VariableStepIntegrator


class ModelState(NamedTuple):
    """Snapshot of an instance and of its integration; times in s."""

    fmu_state: Any
    time: float
    next_event_time: float


class ModelExchangeInstance(EventModeInstance):
    """Base of the Model Exchange instances.

    The other base of a subclass is the Co-Simulation instance of the FMI version.
    """

    #: names of the C functions by role, see `ContinuousModel`
    _function_names: Mapping[str, str]
    _continue_method = "enterContinuousTimeMode"

    def __init__(self, file: FmuFile, instance_name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        super().__init__(file, instance_name, settings)
        self._integrator: Integrator | None = None
        self._integration_call: PreparedCall | None = None
        self._step_duration = 0.0

    # -- life cycle
    # ------------------------------------------------------------------------------------------------------

    def _prepare_transfers(self, factory: AccessorCallFactory) -> None:
        super()._prepare_transfers(factory)
        self._linear_inputs = LinearInputs(self._inputs, self.description.value_references)

    def _prepare_input_slopes(self, _factory: AccessorCallFactory) -> list[PreparedCall]:
        """Return no calls: the importer itself computes the values of linear inputs."""
        return []

    def exit_initialization_mode(self) -> None:
        """Call fmi*ExitInitializationMode, iterate the initial event and enter Continuous-Time Mode."""
        super().exit_initialization_mode()
        self._iterate_initial_event()
        names = {role: self._c_prefix + name for role, name in self._function_names.items()}
        counts, completes = self._count_states(), self.description.needs_completed_step
        model = ContinuousModel(
            self.major,
            self._fmu.functions,
            self._handle,
            names,
            counts,
            completes,
            self._linear_inputs,
        )
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

    # -- events
    # ----------------------------------------------------------------------------------------------------------

    @property
    def _is_stepping(self) -> bool:
        return self._integrator is not None

    def _continuous_inputs_changed(self) -> None:
        assert self._integrator is not None
        self._integrator.inputs_changed()

    def _handle_event(self, change: Callable[[], object] = lambda: None) -> None:
        """Handle an event at the present time of the integration.

        `change` sets variables in Event Mode.
        """
        assert self._integrator is not None
        super()._handle_event(change)
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
                raise ComponentError(
                    self.name, error.function, error.reason, self._current_time.value
                ) from None
            raise self.status_error(error.function, error.status) from None

    # -- steps
    # -----------------------------------------------------------------------------------------------------------

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
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
        reason = (
            f"more than {MAX_EVENTS_PER_STEP} events in one communication step, the last one at t "
            f"= {time:.12g} s"
        )
        raise ComponentError(self.name, function, reason, self._current_time.value)

    # -- states
    # ----------------------------------------------------------------------------------------------------------

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
