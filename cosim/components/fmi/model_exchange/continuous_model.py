"""An FMU in Continuous-Time Mode, its linear inputs, and the interface of its integrators."""

import ctypes
from collections.abc import Callable, Mapping
from enum import IntFlag
from typing import Any, NamedTuple, Protocol

import numpy as np

from ....core.component import SUCCESS_STATUSES, Ports, PreparedCall
from ..library import FunctionTable, as_pointer, as_size


class EventKind(IntFlag):
    """Reasons why an integration stops before the end of a communication step.

    The same numbers as in `_fixed_step.c`.
    """

    STATE = 1
    TIME = 2
    STEP = 4
    TERMINATION = 8


class StepEvent(NamedTuple):
    """Event at `time` (s)."""

    kind: EventKind
    time: float


class Integrator(Protocol):
    """Integrator of one FMU instance in Continuous-Time Mode.

    Attributes:
        needs_input_changes: `inputs_changed` is called before each step with other inputs; an
            integrator that keeps slopes or a history from step to step needs it.
    """

    needs_input_changes: bool = True

    @property
    def time(self) -> float:
        """Time (s) to which the FMU has been integrated."""

    def prepare_step(self, current_time: ctypes.c_double, step_size: float) -> PreparedCall:
        """Prepare a call that integrates one communication step.

        The call returns OK at its end and discard at an event or after a failure; called again, it
        continues.

        Args:
            current_time: Memory from which the call reads the start of the step (s).
            step_size: Length of the step (s).
        """

    def restart(self, time: float, next_event_time: float) -> None:
        """Continue after a discontinuity.

        Args:
            time: Time of the discontinuity (s).
            next_event_time: Time of the next time event (s); infinity if there is none.
        """

    def inputs_changed(self) -> None:
        """Take into account that the inputs of the next step are not those of the last one."""
        return

    def take_event(self) -> StepEvent:
        """Return the event at which the last call stopped.

        Raises:
            IntegrationError: The last call failed.
        """

    def close(self) -> None:
        """Release the resources of the integrator."""
        return


_FLOAT64 = np.dtype(np.float64)


class LinearInputs:
    """Inputs that change linearly within a communication step.

    Their values are start + slope * (time - begin) in a step that begins at `begin` (s).

    Attributes:
        begin: Begin of the communication step (s).
        references: Value references of the inputs.
        array: Bound array with the values at the begin of the step.
        indices: Indices of the inputs in `array`.
        slopes: Time derivatives of the inputs (per s), a part of `array`.
        values: Present values of the inputs.
    """

    def __init__(self, ports: Ports, value_references: Mapping[str, int]):
        """Find the inputs with slopes, which follow all other variables of type Float64."""
        positions = {variable.name: part for variable, _, part in ports.elements()}
        inputs = [
            variable.derivative_of
            for variable in ports.variables
            if variable.derivative_of and variable.dtype == _FLOAT64
        ]
        indices: list[int] = []
        for name in inputs:
            indices += range(positions[name].start, positions[name].stop)
        self.begin = 0.0
        self.references = np.array([value_references[name] for name in inputs], np.uint32)
        self.indices = np.array(indices, np.int64)
        self.array = ports.arrays.get(_FLOAT64, np.zeros(0))
        self.slopes = self.array[len(self.array) - len(self.indices) :]
        self.values = np.zeros(len(self.indices))

    def prepare(self, major: int, library: FunctionTable, handle: int, function: str) -> None:
        """Prepare the call of the function that sets inputs of the FMU instance."""
        self._function = library[function]
        self._arguments = (
            as_pointer(handle),
            as_pointer(self.references.ctypes.data),
            as_size(len(self.references)),
            as_pointer(self.values.ctypes.data),
            *((as_size(len(self.values)),) if major > 2 else ()),
        )

    def set(self, time: float) -> int:
        """Set the inputs to their values at `time` (s), and return the status of the FMU.

        OK if there are none.
        """
        if not len(self.references):
            return SUCCESS_STATUSES[0]
        self.values[:] = self.array[self.indices] + self.slopes * (time - self.begin)
        status: int = self._function(*self._arguments)
        return status


class IntegrationError(Exception):
    """Failed call: the function, and the status that it returned or the reason of the failure."""

    def __init__(self, function: str, status: int | None, reason: str = ""):
        super().__init__(function, status, reason)
        self.function, self.status, self.reason = function, status, reason


#: C type of a Boolean by FMI major version
BOOLEAN: Mapping[int, type[Any]] = {1: ctypes.c_char, 2: ctypes.c_int, 3: ctypes.c_bool}


class ContinuousModel:
    """Right-hand side and event indicators of an FMU instance.

    Attributes:
        functions: Names of the C functions by their role.
        states: Continuous states, shape (state_count,).
        derivatives: Derivatives of the states, shape (state_count,).
        nominals: Nominal values of the states, shape (state_count,).
        indicators: Event indicators, shape (indicator_count,).
        needs_completed_step: The FMU requires fmi*CompletedIntegratorStep.
        linear_inputs: Inputs that are set whenever the time is set.
    """

    def __init__(
        self,
        major: int,
        library: FunctionTable,
        handle: int,
        names: Mapping[str, str],
        counts: tuple[int, int],
        completes: bool,
        linear_inputs: LinearInputs,
    ):
        """Prepare the calls.

        Args:
            major: FMI major version.
            library: C functions of the FMU's library.
            handle: Address of the FMU instance.
            names: Names of the C functions by role: set_time, set_states, get_states,
                get_derivatives, get_indicators, get_nominals, complete_step, set_inputs.
            counts: Numbers of continuous states and of event indicators.
            completes: The FMU requires fmi*CompletedIntegratorStep.
            linear_inputs: Inputs that change linearly within a communication step.
        """
        state_count, indicator_count = counts
        self.major, self.library, self.handle, self.functions = major, library, handle, names
        self.states, self.derivatives = np.zeros(state_count), np.zeros(state_count)
        self.nominals, self.indicators = np.ones(state_count), np.zeros(indicator_count)
        self.needs_completed_step, self.linear_inputs = completes, linear_inputs
        linear_inputs.prepare(major, library, handle, names["set_inputs"])
        self._instance, self._set_time = as_pointer(handle), library[names["set_time"]]
        self.get_states = self._array_call("get_states", self.states)
        self.set_states = self._array_call("set_states", self.states)
        self.get_derivatives = self._array_call("get_derivatives", self.derivatives)
        self.get_nominals = self._array_call("get_nominals", self.nominals, is_optional=True)
        self.get_indicators = self._array_call("get_indicators", self.indicators)
        boolean = BOOLEAN[major]
        self._flags = (boolean(), boolean())
        addresses = [as_pointer(ctypes.addressof(flag)) for flag in self._flags]
        # FMI 1.0 has neither the argument noSetFMUStatePriorToCurrentPoint nor a termination
        self._completion_arguments = (self._instance, boolean.from_param(1), *addresses)
        if major == 1:
            self._completion_arguments = (self._instance, addresses[0])

    def is_called(self, role: str) -> bool:
        """Return whether the function of a role is needed.

        Not without states, indicators, inputs or required completion.
        """
        needed = {
            "set_time": True,
            "complete_step": self.needs_completed_step,
            "get_indicators": len(self.indicators) > 0,
            "set_inputs": len(self.linear_inputs.references) > 0,
        }
        return needed.get(role, len(self.states) > 0)

    def _array_call(
        self, role: str, values: np.ndarray, is_optional: bool = False
    ) -> Callable[[], None]:
        """Return a function that transfers an array, and that does nothing if the array is empty.

        A library without an optional function is accepted: the values stay as they are.
        """
        name = self.functions[role]
        if not len(values) or (is_optional and name not in self.library):
            return lambda: None
        function = self.library[name]
        arguments = (self._instance, as_pointer(values.ctypes.data), as_size(len(values)))

        def call() -> None:
            status = function(*arguments)
            if status not in SUCCESS_STATUSES:
                raise IntegrationError(name, status)

        return call

    def set_time(self, time: float) -> None:
        """Set the time (s), and the linear inputs to their values at this time."""
        status = self._set_time(self._instance, ctypes.c_double(time))
        if status not in SUCCESS_STATUSES:
            raise IntegrationError(self.functions["set_time"], status)
        status = self.linear_inputs.set(time)
        if status not in SUCCESS_STATUSES:
            raise IntegrationError(self.functions["set_inputs"], status)

    def check_indicators(self, indicators: np.ndarray) -> None:
        """Raise an IntegrationError if an event indicator is NaN: its events would be missed."""
        if np.isnan(indicators).any():
            number = int(np.flatnonzero(np.isnan(indicators))[0]) + 1
            raise IntegrationError(
                self.functions["get_indicators"], None, f"event indicator {number} is NaN"
            )

    def complete_step(self) -> EventKind:
        """Call fmi*CompletedIntegratorStep if the FMU requires it, and return its requests."""
        kind = EventKind(0)
        if not self.needs_completed_step:
            return kind
        name = self.functions["complete_step"]
        status = self.library[name](*self._completion_arguments)
        if status not in SUCCESS_STATUSES:
            raise IntegrationError(name, status)
        for flag, request in zip(self._flags, (EventKind.STEP, EventKind.TERMINATION), strict=True):
            if flag.value not in (0, b"\0"):
                kind |= request
        return kind
