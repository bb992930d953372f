"""FMI 3.0 Co-Simulation instances, with Event Mode and early return if the FMU offers them."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from ...core import component_log
from ...core.component import PreparedCall, StepResult
from ...core.errors import ComponentError
from ...process.journal import calling_component
from .event_mode import MAX_EVENTS_PER_STEP, EventModeInstance
from .file import FmuFile
from .fmi3 import STEP_FLAGS_CHECK, Fmi3Instance
from .function_calls import OK, WARNING
from .settings import InstanceSettings

#: relative to the step: a lastSuccessfulTime so close to its end has reached it
_TIME_TOLERANCE = 1e-9


class SlaveState(NamedTuple):
    """Snapshot of an instance, and the discrete inputs that it has."""

    fmu_state: Any
    discrete_inputs: Any


class Fmi3Slave(EventModeInstance, Fmi3Instance):
    """Co-Simulation instance of an FMI 3.0 FMU.

    A step that ends early is continued to its end, after its event has been handled in Event Mode.
    """

    _update_method, _continue_method = "updateDiscreteStates", "enterStepMode"

    def __init__(self, file: FmuFile, instance_name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        super().__init__(file, instance_name, settings)
        self._uses_event_mode, self._may_return_early = (
            self.description.has_event_mode,
            self.description.may_return_early,
        )

    def _instantiation_options(self) -> dict[str, bool]:
        return {
            "eventModeUsed": self._uses_event_mode,
            "earlyReturnAllowed": self._may_return_early,
        }

    def _instantiate_fmu(self, logging_on: bool) -> None:
        """Call fmi3InstantiateCoSimulation, again without Event Mode and early return if the FMU refuses what it declares."""
        try:
            super()._instantiate_fmu(logging_on)
        except ComponentError:
            if not (self._uses_event_mode or self._may_return_early):
                raise
            self._uses_event_mode = self._may_return_early = False
            super()._instantiate_fmu(logging_on)
            text = (
                "declares hasEventMode or mightReturnEarlyFromDoStep, but could only be "
                "instantiated without them"
            )
            component_log.log_message(self.name, component_log.WARNING, text)

    @property
    def _is_stepping(self) -> bool:
        return self._uses_event_mode and self._deadline_name == "step"

    def exit_initialization_mode(self) -> None:
        """Call fmi3ExitInitializationMode, and iterate the initial event if the FMU has Event Mode."""
        super().exit_initialization_mode()
        if self._uses_event_mode:
            self._iterate_initial_event()

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Prepare the calls that set the inputs, make one step from `current_time` (s) and get the outputs."""
        calls = super().prepare_step_calls(current_time, step_size)
        if not (self._uses_event_mode and self._discrete_calls):
            return calls
        return [PreparedCall(self._apply_inputs, (), "inputs"), *calls[len(self._set_calls) :]]

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        self._step_size = seconds
        calls = super()._prepare_do_step(step_size, seconds)
        self._do_step_call = calls[0]
        return calls

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Handle the event of a step that set a flag, and continue the step to its end.

        Raises:
            ComponentError: A call failed, or the step makes no progress.
        """
        if function != STEP_FLAGS_CHECK:
            raise self.status_error(function, status)
        start = begin = self._current_time.value
        end = start + self._step_size
        for _ in range(MAX_EVENTS_PER_STEP):
            reached, event_needed, terminate = self._step_result(begin)
            if event_needed and self._uses_event_mode and not terminate:
                self._handle_event()
                terminate = self._terminates
            elif reached <= begin and self._may_return_early and not terminate:
                raise ComponentError(
                    self.name,
                    "fmi3DoStep",
                    f"returned early at t = {reached!r} s without an event",
                    start,
                )
            if terminate or reached >= end - _TIME_TOLERANCE * self._step_size:
                return StepResult(
                    end if not terminate and reached < end else reached, event_needed, terminate
                )
            if not self._may_return_early and not self._accept_early_return(event_needed):
                return StepResult(
                    reached, event_needed, terminate
                )  # an error, which the caller reports
            begin = reached
            if not self._continue_step(begin, end - begin):
                return StepResult(end)
        reason = (
            f"more than {MAX_EVENTS_PER_STEP} events in one communication step, the last one at t "
            f"= {begin:.12g} s"
        )
        raise ComponentError(self.name, "fmi3DoStep", reason, start)

    def _accept_early_return(self, event_needed: bool) -> bool:
        """Return whether a step that ended early, which the FMU does not declare, ended at an event that was handled."""
        if not (event_needed and self._uses_event_mode):
            return False
        self._may_return_early = True
        text = (
            "returned early from fmi3DoStep at an event, without declaring "
            "mightReturnEarlyFromDoStep"
        )
        component_log.log_message(self.name, component_log.WARNING, text)
        return True

    def _continue_step(self, begin: float, duration: float) -> bool:
        """Call fmi3DoStep for the rest of a step (s), and return whether it has set a flag."""
        call = self._do_step_call
        instance, _, _, *others = call.arguments
        with calling_component(self.name, call.name, self._deadline_name, begin):
            status = call.function(
                instance, ctypes.c_double(begin), ctypes.c_double(duration), *others
            )
        if status not in (OK, WARNING):
            raise self.status_error(call.name, status)
        return bool(self._combined_flags.value)

    def get_state(self) -> Any:
        """Return a snapshot of the FMU with its discrete inputs."""
        return SlaveState(super().get_state(), self._last_inputs[1])

    def set_state(self, state: Any) -> None:
        """Restore a snapshot."""
        super().set_state(state.fmu_state)
        self._last_inputs, self._terminates, self._next_event_time = (
            (None, state.discrete_inputs),
            False,
            math.inf,
        )

    def free_state(self, state: Any) -> None:
        """Free the FMU's part of a snapshot."""
        super().free_state(state.fmu_state)
