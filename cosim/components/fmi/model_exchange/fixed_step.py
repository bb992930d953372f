"""Explicit Euler and Runge-Kutta integration at fixed step size.

Events take effect at the end of the step where they occur.
"""

import ctypes
import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np

from ....core.component import NativeDoStep, PreparedCall
from ....core.integration_methods import Method
from ....core.time_grid import exact_fraction
from ..api import DISCARD, OK
from ..library import GilReleasingFunction, as_pointer, function_address
from .continuous_model import ContinuousModel, EventKind, IntegrationError, Integrator, StepEvent

try:
    import cosim.components.fmi.model_exchange._fixed_step as _fixed_step
except ImportError:  # installed without a C compiler
    _fixed_step = None  # type: ignore[assignment]  # a module cannot be declared optional

#: number of evaluations of the right-hand side per step, by method
STAGES: Mapping[Method, int] = {"euler": 1, "rk4": 4}
#: roles of the functions by their number in `_fixed_step.c`
_ROLES: Sequence[str] = (
    "set_time",
    "set_states",
    "get_derivatives",
    "get_indicators",
    "complete_step",
    "set_inputs",
)
#: further members of the state, by their types and in their order in `_fixed_step.c`
_SIZES = (
    "version",
    "stages",
    "state_count",
    "indicator_count",
    "reference_count",
    "input_count",
)
_ARRAYS = (
    "states",
    "derivatives",
    "start_states",
    "sum",
    "indicators",
    "previous_indicators",
    "input_references",
    "input_array",
    "input_indices",
    "input_slopes",
    "input_values",
)
_TIMES = ("next_event_time", "substep_size", "time", "begin")
_PROGRESS = ("substeps", "next_substep", "event", "status", "failed_function")
#: relative to the substep: a time event so close after its end is reached
_TIME_TOLERANCE = 1e-9
#: status of a call that returned an event indicator which is NaN
_NOT_A_NUMBER = -1


class FixedStepState(ctypes.Structure):
    """State of the integration, the same members as `State` in `_fixed_step.c`."""

    _fields_ = [
        ("instance", ctypes.c_void_p),
        *((role, ctypes.c_void_p) for role in _ROLES),
        *((name, ctypes.c_int64) for name in _SIZES),
        *((name, ctypes.c_void_p) for name in _ARRAYS),
        *((name, ctypes.c_double) for name in _TIMES),
        *((name, ctypes.c_int64) for name in _PROGRESS),
    ]


class FixedStepIntegrator(Integrator):
    """Integrator with fixed step size.

    It is in C if the extension was built, else in Python with the same results.
    """

    needs_input_changes = False

    def __init__(self, model: ContinuousModel, method: Method, step_size: Fraction | None):
        """Prepare the integration.

        Args:
            model: The FMU instance in Continuous-Time Mode.
            method: "euler" or "rk4".
            step_size: Largest step size (s); None: the communication step size.
        """
        self._model, self._step_size, self._state = model, step_size, FixedStepState()
        self._start_states, self._sum = np.zeros_like(model.states), np.zeros_like(model.states)
        self._previous_indicators = np.zeros_like(model.indicators)
        state = self._state
        state.instance, state.version, state.stages = model.handle, model.major, STAGES[method]
        state.state_count, state.indicator_count = len(model.states), len(model.indicators)
        for role in _ROLES:
            if model.is_called(role):
                setattr(state, role, function_address(model.library[model.functions[role]]))
        state.states, state.derivatives = model.states.ctypes.data, model.derivatives.ctypes.data
        state.start_states, state.sum = self._start_states.ctypes.data, self._sum.ctypes.data
        state.indicators = model.indicators.ctypes.data
        state.previous_indicators = self._previous_indicators.ctypes.data
        inputs = model.linear_inputs
        state.reference_count, state.input_count = len(inputs.references), len(inputs.indices)
        for name in ("references", "array", "indices", "slopes", "values"):
            setattr(state, f"input_{name}", getattr(inputs, name).ctypes.data)

    @property
    def time(self) -> float:
        """Time (s) to which the FMU has been integrated."""
        return float(self._state.time)

    def prepare_step(self, current_time: ctypes.c_double, step_size: float) -> PreparedCall:
        """Prepare a call that integrates one communication step.

        It returns discard at an event and after a failure.
        """
        exact = exact_fraction(step_size)
        self._state.substeps = math.ceil(exact / self._step_size) if self._step_size else 1
        self._state.substep_size = float(exact / self._state.substeps)
        name = "integration step"
        if _fixed_step is None or ctypes.sizeof(FixedStepState) != _fixed_step.STATE_SIZE:
            return PreparedCall(self._advance_in_python, (current_time, step_size), name)
        function = GilReleasingFunction(_fixed_step.ADVANCE)
        address = ctypes.addressof(self._state)
        arguments = (as_pointer(address), current_time, ctypes.c_double(step_size), ctypes.c_int(1))
        native = NativeDoStep(2, _fixed_step.ADVANCE, address, step_size)
        return PreparedCall(function, arguments, name, native, (self, current_time))

    def restart(self, time: float, next_event_time: float) -> None:
        """Continue after a discontinuity at `time` (s)."""
        self._model.get_states()
        self._model.get_indicators()
        self._previous_indicators[:] = self._model.indicators
        self._state.next_event_time = next_event_time
        self._state.time = time

    def take_event(self) -> StepEvent:
        """Return the event of the last call.

        Raises:
            IntegrationError: A call of the FMU failed.
        """
        state = self._state
        if state.status:
            state.next_substep = 0
            if state.status == _NOT_A_NUMBER:
                self._model.check_indicators(self._model.indicators)
            raise IntegrationError(
                self._model.functions[_ROLES[state.failed_function]], state.status
            )
        return StepEvent(EventKind(state.event), state.time)

    def _advance_in_python(self, current_time: ctypes.c_double, step_size: float) -> int:
        """Make the operations of `advance` in `_fixed_step.c`, in the same order."""
        state, model, time = self._state, self._model, current_time.value
        model.linear_inputs.begin = time
        try:
            while (n := state.next_substep) < state.substeps:
                begin = time + n * state.substep_size
                end = (
                    time + (n + 1) * state.substep_size
                    if n + 1 < state.substeps
                    else time + step_size
                )
                state.event = state.status = 0
                (self._euler_step if state.stages == 1 else self._runge_kutta_step)(begin, end)
                state.time, state.next_substep = end, n + 1
                state.event = self._find_state_event() | model.complete_step()
                if end >= state.next_event_time - _TIME_TOLERANCE * state.substep_size:
                    state.event |= EventKind.TIME
                if state.event:
                    return DISCARD
        except IntegrationError as error:
            roles = {name: role for role, name in model.functions.items()}
            state.status = _NOT_A_NUMBER if error.status is None else error.status
            state.failed_function = _ROLES.index(roles[error.function])
            return DISCARD
        state.next_substep = 0
        return OK

    def _euler_step(self, _begin: float, end: float) -> None:
        model = self._model
        model.get_derivatives()
        model.set_time(end)
        model.states += self._state.substep_size * model.derivatives
        model.set_states()

    def _runge_kutta_step(self, begin: float, end: float) -> None:
        # The classical method of order 4: slopes k1 at the begin, k2 and k3 in the middle, k4 at
        # the end of the step; each is evaluated at the start plus a weight times the slope before
        # it. The step is size / 6 * (k1 + 2 k2 + 2 k3 + k4).
        model, size = self._model, self._state.substep_size
        model.get_derivatives()
        self._start_states[:], self._sum[:] = model.states, model.derivatives
        for time, weight, share in (
            (begin + 0.5 * size, 0.5 * size, 2.0),
            (begin + 0.5 * size, 0.5 * size, 2.0),
            (end, size, 1.0),
        ):
            model.set_time(time)
            model.states[:] = self._start_states + weight * model.derivatives
            model.set_states()
            model.get_derivatives()
            self._sum += share * model.derivatives
        model.states[:] = self._start_states + (size / 6.0) * self._sum
        model.set_states()

    def _find_state_event(self) -> EventKind:
        self._model.get_indicators()
        self._model.check_indicators(self._model.indicators)
        crossed = (self._previous_indicators <= 0) != (self._model.indicators <= 0)
        self._previous_indicators[:] = self._model.indicators
        return EventKind.STATE if crossed.any() else EventKind(0)
