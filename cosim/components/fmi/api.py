"""The C functions of one FMU instance: what the three versions of FMI have in common.

FMPy loads the library and makes the calls outside the stepping loop. In the stepping loop the C
functions are called directly with prepared arguments, because FMPy's own methods take 3 to 30 times
as long.
"""

import ctypes
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from copy import copy
from math import isnan, nan
from typing import Any

import numpy as np

from ...core import component_log
from ...core.component import SUCCESS_STATUSES, PreparedCall, StepResult
from ...core.errors import ComponentError
from ...process import float_mode
from ...process.journal import calling_component
from ...process.process_state import restoring_process_state
from .accessor_calls import AccessorCallFactory
from .description import FmuDescription
from .file import FmuFile
from .library import MissingFunctionError, as_pointer, load_library, unregister_logger
from .preflight.binary import version_deviations
from .preflight.c_functions import ACCESSORS, function_prefix
from .preflight.model_description import Interface
from .preflight.platforms import EXPECTED_TEXTS
from .settings import InstanceSettings

#: names of fmi2Status and fmi3Status by value; "pending" exists in FMI 2.0 only
STATUS_NAMES = ("OK", "warning", "discard", "error", "fatal", "pending")
OK, WARNING, DISCARD, ERROR, FATAL = range(5)
_LOG_LEVELS = {
    OK: component_log.INFO,
    WARNING: component_log.WARNING,
    DISCARD: component_log.WARNING,
}


class StepFlags:
    """Memory into which fmi3DoStep writes what happened in the step."""

    def __init__(self) -> None:
        # three Booleans and one unused byte, so that one 32-bit read covers all flags
        self.booleans, self.reached = (ctypes.c_bool * 4)(), ctypes.c_double()
        self._combined = ctypes.c_uint32.from_buffer(self.booleans)

    def check(self) -> int:
        """Return discard if eventHandlingNeeded, terminateSimulation or earlyReturn is true."""
        return DISCARD if self._combined.value else OK


class FmiApi(ABC):
    """C functions of one FMU instance, as the version of FMI defines them.

    Attributes:
        name: Name of the instance.
        prefix: Prefix of the C functions in messages, "fmi1", "fmi2" or "fmi3".
        c_prefix: Prefix of the C functions in the library.
        handle: Address of the instance.
        current_time: Communication point at which the next step starts (s); doStep reads it.
        is_stepping: The initialization has ended.
        uses_event_mode: Co-Simulation with Event Mode.
        may_return_early: A Co-Simulation step may end before its communication point.
    """

    #: FMI major version
    major: int
    #: end of the names of the C functions that save and restore the state
    state_word = ""
    #: names of the C functions that create and free an instance
    instance_functions: Mapping[Interface, tuple[str, str]]
    #: name of FMPy's method that updates the discrete states
    update_method: str
    #: names, without prefix, of the C functions of Model Exchange by role, see `ContinuousModel`
    model_functions: Mapping[str, str]

    def __init__(
        self, file: FmuFile, description: FmuDescription, name: str, settings: InstanceSettings
    ):
        self._file, self.description, self.name, self.settings = file, description, name, settings
        self.prefix = f"fmi{self.major}"
        self.c_prefix = function_prefix(self.major, description.model_identifier)
        self.uses_event_mode = self.major == 3 and description.has_event_mode
        self.may_return_early = self.major == 3 and description.may_return_early
        #: relative tolerance that the FMU receives; None: none
        self.tolerance = settings.tolerance or description.default_experiment.tolerance
        self.current_time = ctypes.c_double()
        self.is_stepping = False
        #: registration of the logger of FMI 1.0 and 2.0
        self._log_key = 0
        #: FMPy's slave object of this instance
        self._fmu: Any = None
        self._variables = {variable.name: variable for variable in description.variables}
        self._accessors = ACCESSORS[self.major]
        self._create_function, self._free_function = self.instance_functions[description.interface]
        self._is_instantiated, self._has_acquired_file = False, False
        self._logging_on = logging.getLogger(component_log.LOGGER_NAME).isEnabledFor(logging.DEBUG)
        #: ignore messages with status OK
        self._hides_information = False
        self._last_message = ""
        #: name of the deadline (see `Deadlines`) of the calls in the present phase
        self._deadline_name = "initialization"
        self._float_mode = float_mode.FloatModeGuard()

    # -- what differs between the versions

    @abstractmethod
    def _create(self, logging_on: bool) -> None:
        """Call the function that creates the instance."""

    @abstractmethod
    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Set up the experiment and enter the initialization; times in s."""

    @abstractmethod
    def prepare_do_step(self, step_size: float, flags: StepFlags) -> list[PreparedCall]:
        """Prepare doStep from `current_time` with a step size (s).

        Args:
            step_size: Length of the step (s).
            flags: Memory for the results of fmi3DoStep.
        """

    def exit_initialization(self) -> None:
        """Call fmi*ExitInitializationMode."""
        self.call("exitInitializationMode")

    def enter_mode(self, method: str) -> None:
        """Enter a mode of the event handling by FMPy's method."""
        self.call(method)

    def update_discrete_states(self) -> tuple[bool, bool, bool, float]:
        """Update the discrete states once.

        Returns:
            Another update is needed, termination is requested, there is a next time event, and its
            time (s).
        """
        again, terminate, _, _, has_next, next_time = self.call(self.update_method)
        return again, terminate, has_next, next_time

    def count_states(self) -> tuple[int, int]:
        """Return the numbers of continuous states and event indicators."""
        return self.description.state_count, self.description.indicator_count

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Interpret a bad status of a prepared call.

        Raises:
            ComponentError: The status is a failure.
        """
        raise self.status_error(function, status)

    def _configure(self) -> None:
        """Set the structural parameters, which only FMI 3.0 has, in Configuration Mode."""
        raise NotImplementedError

    def _get_strings(self, reference: int, _count: int) -> Sequence[bytes | None]:
        """Return the values of a String variable, with None for null pointers."""
        texts: Sequence[bytes | None] = self.call("getString", [reference])
        return texts

    def _get_binaries(self, reference: int, count: int) -> list[bytes]:
        """Return the values of a Binary variable, a type that only FMI 3.0 has."""
        raise NotImplementedError

    # -- life cycle

    def instantiate(self) -> None:
        """Load the library and instantiate the FMU.

        Raises:
            InputError: The library cannot be loaded.
            ComponentError: The FMU returned no instance.
        """
        folder = self._file.acquire()
        self._has_acquired_file = True
        is_loaded = self._file.library is not None
        with restoring_process_state(self.name):
            with calling_component(self.name, "loading the binary", "load"):
                if self._file.library is None:
                    self._file.library = load_library(self._file, folder)
                # a copy, because creating FMPy's object takes milliseconds
                self._fmu = copy(self._file.library)
                self._fmu.instanceName = self.name
            if not is_loaded:
                self._check_version()
        logs_only_errors = bool(self.description.error_categories) and not self._logging_on
        self._hides_information = logs_only_errors
        with (
            restoring_process_state(self.name),
            calling_component(self.name, self._create_function, "load"),
        ):
            self._create(self._logging_on or logs_only_errors)
        if logs_only_errors:
            self._limit_log_to_errors()
        self._is_instantiated = True
        self.handle: int = self._fmu.component
        self.instance = as_pointer(self.handle)
        self.functions = self._fmu.functions
        self.current_time = ctypes.c_double()
        if self.settings.structural_parameters:
            self._configure()

    def _check_version(self) -> None:
        """Call the functions for the version and the platform.

        A warning about each unexpected text that they return is logged.
        """
        library, texts = self._fmu.dll, {}
        for name in EXPECTED_TEXTS:
            if name.startswith(self.prefix) and hasattr(library, name):
                function = library[name]
                function.restype = ctypes.c_char_p
                with calling_component(self.name, name, "load"):
                    texts[name] = function()
        for text in version_deviations(texts):
            component_log.log_message(self.name, component_log.WARNING, text)

    def _limit_log_to_errors(self) -> None:
        """Call fmi*SetDebugLogging, so that the FMU gives the reason of an error.

        A refusal leaves its log as it is.
        """
        from fmpy.fmi1 import FMICallException

        name = f"{self.prefix}SetDebugLogging"
        with (
            calling_component(self.name, name, "load"),
            suppress(FMICallException, MissingFunctionError),
        ):
            self._fmu.setDebugLogging(True, self.description.error_categories)

    def instantiation_error(self) -> ComponentError:
        """Return the error for an FMU that returned no instance."""
        return ComponentError(
            self.name, self._create_function, self._last_message or "the FMU gave no reason"
        )

    def enter_stepping(self) -> None:
        """From now on calls have the deadline of steps."""
        self._deadline_name, self.is_stepping = "step", True

    @property
    def has_fatal_error(self) -> bool:
        """True after any instance of this FMU has returned fatal."""
        return self._file.has_fatal_error

    def terminate(self) -> None:
        """Call fmi*Terminate, unless an instance of the FMU has returned fatal."""
        # messages after the last step contain no time
        self._deadline_name, self.current_time = "end", ctypes.c_double(nan)
        if not self._file.has_fatal_error:
            self.call("terminate")

    def free(self) -> None:
        """Free the instance, unless one of the FMU has returned fatal, and release the file."""
        if self._is_instantiated and not self._file.has_fatal_error:
            with calling_component(self.name, self._free_function, "end"):
                getattr(self._fmu, self._free_function)(self.handle)
        self._is_instantiated = False
        unregister_logger(self._log_key)
        if self._has_acquired_file:
            self._has_acquired_file = False
            with calling_component(self.name, "unloading the binary", "end"):
                self._file.release()

    # -- calls

    def call(self, function: str, *arguments: Any, unavailable_status: int | None = None) -> Any:
        """Call an FMI function outside the stepping loop.

        Args:
            function: Name of FMPy's method, such as "getReal", or full name of a C function, such
                as "fmi3GetString".
            *arguments: Arguments of the function.
            unavailable_status: Status that means that no value is available.

        Returns:
            The result of the function, or None for `unavailable_status`.

        Raises:
            ComponentError: The function returned a bad status, or the library does not export it.
        """
        from fmpy.fmi1 import FMICallException

        name = self.full_name(function)
        with calling_component(self.name, name, self._deadline_name, self.current_time.value):
            try:
                result = getattr(self._fmu, function)(*arguments)
            except FMICallException as error:
                if error.status == unavailable_status:
                    return None
                raise self.status_error(error.function, error.status) from None
            except MissingFunctionError:
                if unavailable_status is not None:
                    return None
                raise ComponentError(
                    self.name, name, "the library does not export this function"
                ) from None
        self.restore_float_mode(name)
        return result

    def execute(
        self,
        calls: Sequence[PreparedCall],
        read_status: Callable[[str, int], StepResult] | None = None,
        begin: float | None = None,
    ) -> StepResult | None:
        """Execute prepared calls outside the executors.

        Args:
            calls: The calls.
            read_status: Reads the meaning of a bad status, which ends the calls, given the name of
                the call and the status; by default it is a failure.
            begin: Time (s) at which the calls are made; by default `current_time`.
        """
        time = self.current_time.value if begin is None else begin
        for call in calls:
            with calling_component(self.name, call.name, self._deadline_name, time):
                status = call.function(*call.arguments)
            if status not in SUCCESS_STATUSES:
                return (read_status or self.interpret_status)(call.name, status)
            self.restore_float_mode(call.name)
        return None

    def full_name(self, function: str) -> str:
        """Return the name of the C function for FMPy's method, such as "getReal", or for itself."""
        if function.startswith(self.prefix):
            return function
        return self.prefix + function[0].upper() + function[1:]

    def restore_float_mode(self, function: str) -> None:
        """Restore the default floating-point mode if the last call, of `function`, changed it."""
        if float_mode.is_changed() or float_mode.enabled_traps():
            self._float_mode.restore(self.name, function, self.current_time.value)

    def error(self, function: str, reason: str) -> ComponentError:
        """Return the error for a failure of a function at the present time."""
        time = self.current_time.value
        return ComponentError(self.name, function, reason, None if isnan(time) else time)

    def status_error(self, function: str, status: int, details: str = "") -> ComponentError:
        """Return the error for a bad status, with the last log message and `details` at its end.

        After fatal no function of any instance of this FMU may be called (FMI 3.0 section 2.2.3).
        """
        self._file.has_fatal_error = self._file.has_fatal_error or status == FATAL
        label = STATUS_NAMES[status] if 0 <= status < len(STATUS_NAMES) else "not defined by FMI"
        message = f": {self._last_message}" if self._last_message else ""
        return self.error(function, f"status {status} ({label}){message}{details}")

    def log(self, status: int, text: bytes | None) -> None:
        """Forward a log message of the FMU, and keep it as the reason of a later failure."""
        if status == OK and self._hides_information:
            return
        self._last_message = (text or b"").decode("utf-8", "replace").strip()
        component_log.log_message(
            self.name, _LOG_LEVELS.get(status, component_log.ERROR), self._last_message
        )

    # -- variables and states

    def accessor_calls(self) -> AccessorCallFactory:
        """Return the factory of the prepared calls that get and set variables."""
        return AccessorCallFactory(
            self.major,
            self.c_prefix,
            self.functions,
            self.handle,
            self.description.value_references,
            self._accessors,
        )

    def set(self, name: str, value: Any) -> None:
        """Call the fmi*Set... function of the variable's type.

        Structural parameters already have their values since Configuration Mode.
        """
        if self._variables[name].causality != "structuralParameter":
            self.set_value(name, value)

    def set_value(self, name: str, value: Any) -> None:
        """Call the fmi*Set... function of the variable's type, also for structural parameters."""
        variable, values = self._variables[name], [value]
        if variable.shape:  # an array of objects keeps all digits of 64-bit integers
            values = np.array(value, object).ravel().tolist()
        reference = self.description.value_references[name]
        self.call(f"set{self._accessors[variable.type]}", [reference], values)

    def get(self, name: str) -> Any:
        """Call the fmi*Get... function of the variable's type.

        A negated alias, which only FMI 1.0 has, has the opposite sign.
        """
        variable = self._variables[name]
        reference, count = self.description.value_references[name], len(variable.scalar_names)
        values: Sequence[Any]
        if variable.type == "String":
            texts = self._get_strings(reference, count)
            values = [self._decode_string(name, text) for text in texts]
        elif variable.type == "Binary":
            values = self._get_binaries(reference, count)
        else:
            counts = (count,) if variable.shape else ()
            values = self.call(f"get{self._accessors[variable.type]}", [reference], *counts)
        if variable.shape:
            return values
        value: Any = values[0]
        if name not in self.description.negated:
            return value
        return not value if variable.type == "Boolean" else -value

    def _decode_string(self, name: str, text: bytes | None) -> str:
        if text is None:
            reason = f'the value of "{name}" is a null pointer, expected a text'
            raise self.error(f"{self.prefix}GetString", reason)
        return text.decode("utf-8", "replace")

    def get_directional_derivative(
        self, outputs: Sequence[str], input_name: str
    ) -> Sequence[float] | None:
        """Call fmi*GetDirectionalDerivative.

        None for an FMU that does not provide it and for elements of arrays.
        """
        references = self.description.value_references
        is_offered = self.description.directional_derivatives
        if not is_offered or not {input_name, *outputs} <= references.keys():
            return None
        unknowns = [references[name] for name in outputs]
        found: Sequence[float] | None = self.call(
            "getDirectionalDerivative",
            unknowns,
            [references[input_name]],
            [1.0],
            unavailable_status=DISCARD,
        )
        return found

    def get_state(self) -> Any:
        """Call fmi*GetFMUState."""
        return self.call(f"get{self.state_word}")

    def set_state(self, state: Any) -> None:
        """Call fmi*SetFMUState."""
        self.call(f"set{self.state_word}", state)

    def free_state(self, state: Any) -> None:
        """Call fmi*FreeFMUState."""
        self.call(f"free{self.state_word}", state)
