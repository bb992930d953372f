"""Integration with variable step size by CVODE.

State events are located by root finding, time events are met exactly. The libraries of SUNDIALS are
those that FMPy contains. Its own wrapper passes over internal steps, leaves memory behind, and
prints errors of callbacks instead of raising them.
"""

import ctypes
import math
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from ctypes import CFUNCTYPE, byref, c_char_p, c_double, c_int, c_int64, c_void_p
from typing import Any

import numpy as np

from ....core.component import SUCCESS_STATUSES, PreparedCall
from ....core.errors import InputError
from ..api import DISCARD, OK
from ..library import as_pointer, as_size
from .continuous_model import ContinuousModel, EventKind, IntegrationError, Integrator, StepEvent

#: `CV_BDF`, `CV_ONE_STEP`, and the results of CVode
_BDF, _ONE_STEP = 2, 2
SUCCESS, STOP_TIME_REACHED, ROOT_FOUND = range(3)
#: results of the right-hand side and the root function: the solver ends, or tries a smaller step
FAILED, RECOVERABLE = -1, 1

#: right-hand side (time, address of the states, address of the derivatives) and roots (time,
#: states, values)
Evaluation = Callable[[float, int, int], int]
_RIGHT_HAND_SIDE = CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_void_p)
_ERROR_HANDLER = CFUNCTYPE(None, c_int, c_char_p, c_char_p, c_char_p, c_int, c_void_p, c_void_p)


class SolverError(Exception):
    """Reason why CVODE cannot continue."""


class Cvode:
    """One initial value problem, solved by variable-order BDF with a dense linear solver.

    Args:
        states: States, float64, shape (n,) with n > 0; the solver reads and writes them in place.
        derivatives: Right-hand side.
        roots: Root function.
        root_count: Number of roots.

    Raises:
        InputError: FMPy has no SUNDIALS libraries for this platform.
    """

    def __init__(
        self, states: np.ndarray, derivatives: Evaluation, roots: Evaluation, root_count: int
    ):
        self._states, self._message = states, ""
        self._absolute_tolerances = np.zeros_like(states)
        self._time = c_double()
        self._free = ExitStack()
        self._load_libraries()
        address = self._cvode["N_VGetArrayPointer_Serial"]
        address.restype, address.argtypes = c_void_p, [c_void_p]
        self._callbacks = (
            _RIGHT_HAND_SIDE(lambda time, x, dx, _: derivatives(time, address(x), address(dx))),
            _RIGHT_HAND_SIDE(lambda time, x, values, _: roots(time, address(x), values)),
            _ERROR_HANDLER(self._store_message),
        )
        self._create(root_count)

    def _load_libraries(self) -> None:
        try:
            from fmpy.sundials.libraries import sundials_core, sundials_cvode
        except (ImportError, OSError):
            raise InputError(
                'the method "cvode" is not available on this platform; use "euler" or "rk4"'
            ) from None
        self._core, self._cvode = sundials_core, sundials_cvode

    def _create(self, root_count: int) -> None:
        core, context, logger = self._core, c_void_p(), c_void_p()
        core["SUNContext_Create"](0, byref(context))
        self._free.callback(core["SUNContext_Free"], byref(context))
        core["SUNContext_ClearErrHandlers"](context)
        core["SUNContext_PushErrHandler"](context, self._callbacks[2], None)
        core["SUNContext_GetLogger"](context, byref(logger))
        core["SUNLogger_SetWarningFilename"](logger, os.devnull.encode())
        size = c_int64(len(self._states))
        self._x, self._tolerances = (
            self._owned(
                "N_VDestroy_Serial", "N_VMake_Serial", size, array.ctypes.data_as(c_void_p), context
            )
            for array in (self._states, self._absolute_tolerances)
        )
        matrix = self._owned("SUNMatDestroy_Dense", "SUNDenseMatrix", size, size, context)
        solver = self._owned("SUNLinSolFree_Dense", "SUNLinSol_Dense", self._x, matrix, context)
        self._memory = self._pointer("CVodeCreate", _BDF, context)
        self._free.callback(self._cvode["CVodeFree"], byref(self._memory))
        self._call("CVodeInit", self._callbacks[0], c_double(0.0), self._x)
        self._call("CVodeSVtolerances", c_double(1.0), self._tolerances)
        self._call("CVodeRootInit", root_count, self._callbacks[1])
        self._call("CVodeSetNoInactiveRootWarn")
        self._call("CVodeSetLinearSolver", solver, matrix)

    def _pointer(self, function: str, *arguments: Any) -> c_void_p:
        """Call a function that returns a pointer."""
        create = self._cvode[function]
        create.restype = c_void_p
        return c_void_p(create(*arguments))

    def _owned(self, destructor: str, function: str, *arguments: Any) -> c_void_p:
        """Call a function that creates an object, which `close` destroys."""
        created = self._pointer(function, *arguments)
        self._free.callback(self._cvode[destructor], created)
        return created

    def _call(self, function: str, *arguments: Any) -> int:
        flag: int = self._cvode[function](self._memory, *arguments)
        if flag < 0:
            raise SolverError(self._message)
        return flag

    def _store_message(
        self, _line: int, _function: bytes, _file: bytes, text: bytes, *_: Any
    ) -> None:
        self._message = (text or b"").decode("utf-8", "replace").strip()

    def restart(self, time: float, tolerance: float, absolute_tolerances: np.ndarray) -> None:
        """Forget the history and continue from the present states.

        Args:
            time: Present time (s).
            tolerance: Relative tolerance.
            absolute_tolerances: Absolute tolerances of the states, shape (n,).
        """
        self._absolute_tolerances[:] = absolute_tolerances
        self._call("CVodeReInit", c_double(time), self._x)
        self._call("CVodeSVtolerances", c_double(tolerance), self._tolerances)

    def step(self, stop_time: float) -> tuple[int, float]:
        """Make one internal step, not beyond `stop_time` (s).

        Returns:
            SUCCESS, STOP_TIME_REACHED or ROOT_FOUND, and the time reached (s), to which the states
            belong.

        Raises:
            SolverError: The step failed.
            BaseException: An evaluation raised this exception, or a signal arrived during it.
        """
        self._message = ""
        end = c_double(stop_time)
        self._cvode["CVodeSetStopTime"](self._memory, end)
        with self._raising_exceptions_of_callbacks():
            flag = self._cvode["CVode"](self._memory, end, self._x, byref(self._time), _ONE_STEP)
        if flag < 0:
            raise SolverError(self._message)
        return flag, self._time.value

    @contextmanager
    def _raising_exceptions_of_callbacks(self) -> Iterator[None]:
        """Raise the first exception of a callback after the block.

        ctypes would print it and continue.
        """
        hook, exceptions = sys.unraisablehook, []
        sys.unraisablehook = lambda failure: exceptions.append(failure.exc_value)
        try:
            yield
        finally:
            sys.unraisablehook = hook
        if exceptions:
            raise exceptions[0] or SolverError("a callback failed")

    def close(self) -> None:
        """Free the memory of the solver."""
        self._free.close()


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
        self._set_states = self._transfer("set_states")
        self._get_derivatives = self._transfer("get_derivatives")
        self._get_indicators = self._transfer("get_indicators")

    def _transfer(self, role: str) -> Callable[[int], None]:
        """Return a function that transfers the array at an address by the function of a role."""
        model = self._model
        if not model.is_called(role):
            return lambda _: None
        name = model.functions[role]
        count = len(model.indicators if role == "get_indicators" else model.states)
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

    def _evaluate(
        self, time: float, states: int, transfer: Callable[[int], None], result: int
    ) -> int:
        """Transfer the values at a time (s) and states to the address `result`.

        A discarded evaluation makes CVODE try a smaller step.
        """
        try:
            self._model.set_time(time)
            self._set_states(states)
            transfer(result)
        except IntegrationError as error:
            self._failure = error
            return RECOVERABLE if error.status == DISCARD else FAILED
        return OK

    def _evaluate_derivatives(self, time: float, states: int, derivatives: int) -> int:
        return self._evaluate(time, states, self._get_derivatives, derivatives)

    def _evaluate_nothing(self, _time: float, _states: int, derivatives: int) -> int:
        ctypes.c_double.from_address(derivatives).value = 0.0
        return OK

    def _evaluate_indicators(self, time: float, states: int, indicators: int) -> int:
        return self._evaluate(time, states, self._get_checked_indicators, indicators)

    def _get_checked_indicators(self, address: int) -> None:
        self._get_indicators(address)
        count = len(self._model.indicators)
        self._model.check_indicators(
            np.ctypeslib.as_array((ctypes.c_double * count).from_address(address))
        )

    # -- steps

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
        """Make one step of the solver, up to `target` (s) at most.

        Return its event, of kind 0 if there is none. A `target` in the past is a time event that
        the FMU announces too late: it takes place at once.
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
            if self._step_of_solver(target) == ROOT_FOUND:
                kind = EventKind.STATE
        else:
            self._time = max(self._time, target)
        self._model.set_time(self._time)
        self._model.set_states()
        kind |= self._model.complete_step()
        if self._time >= self._next_event_time:
            kind |= EventKind.TIME
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
