"""Integration with variable step size by CVODE.

State events are located by root finding, time events are met exactly.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable

import numpy as np

from ....core.component import SUCCESS_STATUSES, PreparedCall
from ..c_functions import as_pointer, as_size
from ..function_calls import DISCARD, OK
from .continuous_model import ContinuousModel, IntegrationError
from .integrator import EventKind, Integrator, StepEvent
from .sundials import FAILED, RECOVERABLE, ROOT_FOUND, Cvode, SolverError

#: intervals shorter than this number of units in the last place of the time are not integrated
_MIN_ULPS = 16
#: largest number of consecutive internal steps that do not change the time
_MAX_STALLED_STEPS = 100


class VariableStepIntegrator(Integrator):
    """Integrator with CVODE.

    Steps end at communication points and at time events; each is completed in the FMU.
    """

    def __init__(self, model: ContinuousModel, tolerance: float):
        """Prepare the integration.

        Args:
            model: The FMU instance in Continuous-Time Mode.
            tolerance: Relative tolerance; the absolute ones are its products with the nominal
                values of the states.

        Raises:
            InputError: The method is not available on this platform.
        """
        self._model, self._tolerance = model, tolerance
        self._time, self._next_event_time, self._must_restart = 0.0, math.inf, True
        self._event, self._stalled_steps = StepEvent(EventKind(0), 0.0), 0
        self._failure: IntegrationError | None = None
        #: a model without states gets one that is constant, because CVODE needs one
        self._states = model.states if len(model.states) else np.zeros(1)
        derivatives = self._evaluate_derivatives if len(model.states) else self._evaluate_nothing
        self._cvode = Cvode(
            self._states, derivatives, self._evaluate_indicators, len(model.indicators)
        )
        self._set_states, self._get_derivatives = (
            self._transfer("set_states"),
            self._transfer("get_derivatives"),
        )
        self._get_indicators = self._transfer("get_indicators")

    def _transfer(self, role: str) -> Callable[[int], None]:
        """Return a function that calls the FMU's function of a role with the array at an address."""
        model = self._model
        if not model.is_called(role):
            return lambda _: None
        name, count = (
            model.functions[role],
            len(model.indicators if role == "get_indicators" else model.states),
        )
        function, instance, size = model.library[name], as_pointer(model.handle), as_size(count)

        def call(address: int) -> None:
            status = function(instance, ctypes.c_void_p(address), size)
            if status not in SUCCESS_STATUSES:
                raise IntegrationError(name, status)

        return call

    @property
    def time(self) -> float:
        """Time (s) to which the FMU has been integrated."""
        return self._time

    # -- functions that CVODE calls
    # ------------------------------------------------------------------------------------

    def _guarded(self, evaluate: Callable[[], None]) -> int:
        """Return the result of a callback.

        A discarded evaluation makes CVODE try a smaller step.
        """
        try:
            evaluate()
        except IntegrationError as error:
            self._failure = error
            return RECOVERABLE if error.status == DISCARD else FAILED
        return OK

    def _evaluate_derivatives(self, time: float, states: int, derivatives: int) -> int:
        def evaluate() -> None:
            self._model.set_time(time)
            self._set_states(states)
            self._get_derivatives(derivatives)

        return self._guarded(evaluate)

    def _evaluate_nothing(self, _time: float, _states: int, derivatives: int) -> int:
        ctypes.c_double.from_address(derivatives).value = 0.0
        return OK

    def _evaluate_indicators(self, time: float, states: int, indicators: int) -> int:
        def evaluate() -> None:
            self._model.set_time(time)
            self._set_states(states)
            self._get_indicators(indicators)
            self._model.check_indicators(
                np.ctypeslib.as_array((ctypes.c_double * count).from_address(indicators))
            )

        count = len(self._model.indicators)
        return self._guarded(evaluate)

    # -- steps
    # ---------------------------------------------------------------------------------------------------------

    def prepare_step(self, current_time: ctypes.c_double, step_size: float) -> PreparedCall:
        """Prepare a call that integrates one communication step.

        It returns discard at an event and after a failure.
        """
        return PreparedCall(self._advance, (current_time, step_size), "integration step")

    def restart(self, time: float, next_event_time: float) -> None:
        """Continue after a discontinuity at `time` (s)."""
        self._model.get_states()
        self._time, self._next_event_time, self._must_restart = time, next_event_time, True

    def inputs_changed(self) -> None:
        """Restart the solver at the next step, because its history belongs to other inputs."""
        self._must_restart = True

    def take_event(self) -> StepEvent:
        """Return the event of the last call.

        Raises:
            IntegrationError: A call of the FMU or the solver failed.
        """
        if self._failure:
            failure, self._failure = self._failure, None
            raise failure
        return self._event

    def _advance(self, current_time: ctypes.c_double, step_size: float) -> int:
        end = current_time.value + step_size
        self._model.linear_inputs.begin = current_time.value
        self._failure = None
        try:
            while end - self._time > _MIN_ULPS * math.ulp(end):
                self._event = self._integrate_to(min(end, self._next_event_time))
                if self._event.kind:
                    return DISCARD
        except SolverError as error:
            self._failure = self._failure or IntegrationError(
                "CVode", None, f"at t = {self._time:.12g} s: {error}"
            )
            return DISCARD
        except IntegrationError as error:
            self._failure = error
            return DISCARD
        self._failure = None
        return OK

    def _integrate_to(self, target: float) -> StepEvent:
        """Make one step of the solver up to `target` (s) at most, and return its event, of kind 0 if there is none.

        A `target` in the past is a time event that the FMU announces too late: it takes place at once.
        """
        kind = EventKind(0)
        if target - self._time > _MIN_ULPS * math.ulp(target):
            if self._must_restart:
                self._model.get_nominals()
                nominals = np.abs(self._model.nominals) if len(self._model.states) else np.ones(1)
                valid = np.where(
                    (nominals > 0) & np.isfinite(nominals), nominals, 1.0
                )  # some FMUs return 0
                self._cvode.restart(self._time, self._tolerance, self._tolerance * valid)
                self._must_restart = False
            kind = EventKind.STATE if self._step_of_solver(target) == ROOT_FOUND else kind
        else:
            self._time = max(self._time, target)
        self._model.set_time(self._time)
        self._model.set_states()
        completion = self._model.complete_step()
        kind |= EventKind.STEP if completion.event_needed else EventKind(0)
        kind |= EventKind.TERMINATION if completion.terminate_requested else EventKind(0)
        kind |= EventKind.TIME if self._time >= self._next_event_time else EventKind(0)
        return StepEvent(kind, self._time)

    def _step_of_solver(self, target: float) -> int:
        """Make one internal step of CVODE and return its result.

        Many steps without progress are an error.
        """
        flag, time = self._cvode.step(target)
        self._stalled_steps = self._stalled_steps + 1 if time == self._time else 0
        if self._stalled_steps > _MAX_STALLED_STEPS:
            raise SolverError(
                f"{_MAX_STALLED_STEPS} internal steps without progress; a derivative may be "
                "infinite"
            )
        self._time = time
        return flag

    def close(self) -> None:
        """Free the memory of the solver."""
        self._cvode.close()
