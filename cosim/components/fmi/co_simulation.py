"""Co-Simulation of FMUs: the FMU integrates, with events and early return in FMI 3.0."""

import ctypes
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ...core import component_log
from ...core.component import PreparedCall, StepResult
from ...core.errors import ComponentError
from .accessor_calls import AccessorCallFactory
from .api import OK, StepFlags
from .driver import MAX_EVENTS_PER_STEP, FmuDriver, is_value
from .versions import STEP_FLAGS_CHECK

#: relative to the step: a lastSuccessfulTime so close to its end has reached it
_TIME_TOLERANCE = 1e-9


class CoSimulationState(NamedTuple):
    """Snapshot of an instance, and the discrete inputs that it has."""

    fmu_state: Any
    discrete_inputs: Any


class CoSimulationFmu(FmuDriver):
    """Component of a Co-Simulation FMU.

    A step that ends early is continued to its end, after its event has been handled in Event Mode.
    """

    #: length (s) of the step that is being made
    _step_size = 0.0

    def _prepare_linear_inputs(self, factory: AccessorCallFactory) -> None:
        self._flags = StepFlags()
        self._slope_calls = factory.prepare(
            "Set", self._inputs, self._set_object, lambda variable: not is_value(variable)
        )

    def exit_initialization_mode(self) -> None:
        """Exit the initialization mode, and iterate the initial event if there is Event Mode."""
        self._end_initialization()
        if self.api.uses_event_mode:
            self._event_mode = self._start_event_mode("enterStepMode")

    # -- steps

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Prepare the calls that set the inputs, make one step and get the outputs."""
        self.api.current_time = current_time
        set_calls: Sequence[PreparedCall] = self._set_calls
        if self._event_mode and self._event_mode.discrete_calls:
            set_calls = [PreparedCall(self._event_mode.apply_inputs, (), "inputs")]
        return [*set_calls, *self._prepare_step(step_size), *self._get_calls]

    def _prepare_step(self, step_size: float) -> list[PreparedCall]:
        self._step_size = step_size
        calls = self.api.prepare_do_step(step_size, self._flags)
        self._do_step_call = calls[0]
        return [*self._slope_calls, *calls]

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Call fmi*DoStep."""
        self.api.current_time.value = time
        return self.api.execute(self._prepare_step(step_size), self.interpret_status)

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Interpret a bad status, and continue a step of FMI 3.0 that set a flag to its end.

        Raises:
            ComponentError: A call failed, or the step makes no progress.
        """
        if function != STEP_FLAGS_CHECK:
            return self.api.interpret_status(function, status)
        api, events = self.api, self._event_mode
        start = begin = api.current_time.value
        end = start + self._step_size
        for _ in range(MAX_EVENTS_PER_STEP):
            reached, event_needed, terminate = self._step_result(begin)
            if event_needed and events and not terminate:
                events.handle()
                terminate = events.terminates
            elif reached <= begin and api.may_return_early and not terminate:
                reason = f"returned early at t = {reached!r} s without an event"
                raise api.error("fmi3DoStep", reason)
            if terminate or reached >= end - _TIME_TOLERANCE * self._step_size:
                time = end if not terminate and reached < end else reached
                return StepResult(time, event_needed, terminate)
            if not api.may_return_early and not self._accept_early_return(event_needed):
                # an error, which the caller reports
                return StepResult(reached, event_needed, terminate)
            begin = reached
            if not self._continue_step(begin, end - begin):
                return StepResult(end)
        reason = (
            f"more than {MAX_EVENTS_PER_STEP} events in one communication step, the last one at t "
            f"= {begin:.12g} s"
        )
        raise api.error("fmi3DoStep", reason)

    def _step_result(self, begin: float) -> StepResult:
        """Return the result of fmi3DoStep from `begin` (s).

        A lastSuccessfulTime that is NaN or before it is an error.
        """
        reached, (event_needed, terminate, *_) = self._flags.reached.value, self._flags.booleans
        if not reached >= begin:
            reason = f"lastSuccessfulTime is {reached!r} s, expected at least the start of the step"
            raise ComponentError(self.name, "fmi3DoStep", reason, begin)
        return StepResult(reached, event_needed, terminate)

    def _accept_early_return(self, event_needed: bool) -> bool:
        """Return whether a step with an undeclared early return ended at a handled event."""
        if not (event_needed and self._event_mode):
            return False
        self.api.may_return_early = True
        text = (
            "returned early from fmi3DoStep at an event, without declaring "
            "mightReturnEarlyFromDoStep"
        )
        component_log.log_message(self.name, component_log.WARNING, text)
        return True

    def _continue_step(self, begin: float, duration: float) -> bool:
        """Call fmi3DoStep for the rest of a step (s), and return whether it has set a flag."""
        instance, _, _, *others = self._do_step_call.arguments
        arguments = (instance, ctypes.c_double(begin), ctypes.c_double(duration), *others)
        self.api.execute([self._do_step_call._replace(arguments=arguments)], begin=begin)
        return self._flags.check() != OK

    # -- states and end

    def get_state(self) -> Any:
        """Return a snapshot of the FMU with its discrete inputs."""
        discrete_inputs = self._event_mode.last_inputs[1] if self._event_mode else None
        return CoSimulationState(self.api.get_state(), discrete_inputs)

    def set_state(self, state: CoSimulationState) -> None:
        """Restore a snapshot."""
        self.api.set_state(state.fmu_state)
        if self._event_mode:
            self._event_mode.last_inputs = (None, state.discrete_inputs)
            self._event_mode.terminates, self._event_mode.next_event_time = False, math.inf

    def free_state(self, state: CoSimulationState) -> None:
        """Free the FMU's part of a snapshot."""
        self.api.free_state(state.fmu_state)

    def free(self) -> None:
        """Free the instance."""
        self.api.free()
