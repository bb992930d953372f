"""The C functions of FMI 1.0, 2.0 and 3.0."""

import ctypes
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from ...core import component_log
from ...core.component import NativeDoStep, NativeFlagCheck, PreparedCall, StepResult
from ...core.size_limits import MAX_SCALARS
from .api import DISCARD, FmiApi, StepFlags
from .description import FmuDescription
from .file import FmuFile
from .library import as_double, as_pointer, function_address, register_logger
from .settings import InstanceSettings

#: values of fmi*StatusKind of FMI 1.0 and 2.0
_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3
#: largest accepted size of one Binary value (bytes)
MAX_BINARY_SIZE = 1 << 28
#: name of the prepared call that follows fmi3DoStep
STEP_FLAGS_CHECK = "fmi3DoStep (returned flags)"

_MODEL_FUNCTIONS = {
    "set_time": "SetTime",
    "set_states": "SetContinuousStates",
    "get_states": "GetContinuousStates",
    "get_derivatives": "GetDerivatives",
    "get_indicators": "GetEventIndicators",
    "get_nominals": "GetNominalsOfContinuousStates",
    "complete_step": "CompletedIntegratorStep",
    "set_inputs": "SetReal",
}


def create_api(
    file: FmuFile, description: FmuDescription, name: str, settings: InstanceSettings
) -> FmiApi:
    """Return the C functions of an instance for the FMI version of its FMU.

    Args:
        file: The FMU.
        description: Its model description.
        name: Name of the instance.
        settings: Tolerance and structural parameters.
    """
    return _APIS[description.major](file, description, name, settings)


class Fmi1Api(FmiApi):
    """C functions of FMI 1.0.

    FMI 1.0 has no initialization mode: fmiInitializeSlave ends the initialization, and inputs can
    be set and outputs be read only afterwards. Therefore the start values of inputs are those of
    the FMU while it is initialized, and the values of connected outputs follow before the first
    step. It has no modes for events either.
    """

    major = 1
    instance_functions = {
        "co-simulation": ("fmi1InstantiateSlave", "fmi1FreeSlaveInstance"),
        "model-exchange": ("fmi1InstantiateModel", "fmi1FreeModelInstance"),
    }
    update_method = "eventUpdate"
    model_functions = _MODEL_FUNCTIONS | {"get_nominals": "GetNominalContinuousStates"}

    def _create(self, logging_on: bool) -> None:
        from fmpy import fmi1

        callbacks = fmi1.fmi1CallbackFunctions()
        self._log_key = register_logger(callbacks, self.name, self.log)
        with suppress(Exception):  # FMPy's exception of a null pointer has no reason
            self._fmu.instantiate(functions=callbacks, loggingOn=logging_on)
        if not self._fmu.component:
            raise self.instantiation_error()

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Call fmiInitializeSlave, or fmiSetTime and fmiInitialize of Model Exchange."""
        self.current_time.value = start_time
        if self.description.interface == "co-simulation":
            self.call("initialize", start_time, stop_time)
            return
        self.call("setTime", start_time)
        self.call("initialize", self.tolerance is not None, self.tolerance or 0.0)

    def exit_initialization(self) -> None:
        """Do nothing: the initialization has already ended."""

    def enter_mode(self, method: str) -> None:
        """Do nothing: FMI 1.0 has no modes."""

    def update_discrete_states(self) -> tuple[bool, bool, bool, float]:
        """Call fmiEventUpdate."""
        converged, _, _, terminate, has_next, next_time = self.call(self.update_method)
        return not converged, terminate, has_next, next_time

    def prepare_do_step(self, step_size: float, _flags: StepFlags) -> list[PreparedCall]:
        """Prepare fmiDoStep."""
        return [_prepare_do_step(self, ctypes.c_char.from_param(1), step_size)]

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Raise the error for a bad status, with the time that a discarded step reached."""
        details = ""
        if function == "fmi1DoStep" and status == DISCARD:
            message = self._last_message
            reached = self.call("getRealStatus", _LAST_SUCCESSFUL_TIME, unavailable_status=DISCARD)
            self._last_message = message
            if reached is not None:
                details = f"; lastSuccessfulTime is {reached.value:.12g} s"
        raise self.status_error(function, status, details)


class Fmi2Api(FmiApi):
    """C functions of FMI 2.0."""

    major = 2
    state_word = "FMUstate"
    instance_functions = {
        "co-simulation": ("fmi2Instantiate", "fmi2FreeInstance"),
        "model-exchange": ("fmi2Instantiate", "fmi2FreeInstance"),
    }
    update_method = "newDiscreteStates"
    model_functions = _MODEL_FUNCTIONS

    def _create(self, logging_on: bool) -> None:
        from fmpy import fmi2

        callbacks = fmi2.fmi2CallbackFunctions()
        self._log_key = register_logger(callbacks, self.name, self.log)
        try:
            self._fmu.instantiate(callbacks=callbacks, loggingOn=logging_on)
        except Exception:
            raise self.instantiation_error() from None

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Call fmi2SetupExperiment and fmi2EnterInitializationMode."""
        self.current_time.value = start_time
        self.call("setupExperiment", self.tolerance, start_time, stop_time)
        self.call("enterInitializationMode")

    def prepare_do_step(self, step_size: float, _flags: StepFlags) -> list[PreparedCall]:
        """Prepare fmi2DoStep."""
        return [_prepare_do_step(self, ctypes.c_int.from_param(1), step_size)]

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Interpret a bad status.

        Fmi2Discard with `terminated` ends the simulation (FMI 2.0 section 4.2.1).

        Raises:
            ComponentError: For every other bad status.
        """
        if function != "fmi2DoStep" or status != DISCARD:
            raise self.status_error(function, status)
        message, start = self._last_message, self.current_time.value
        terminated = self.call("getBooleanStatus", _TERMINATED, unavailable_status=DISCARD)
        reached = self.call("getRealStatus", _LAST_SUCCESSFUL_TIME, unavailable_status=DISCARD)
        if terminated and (reached is None or reached >= start):
            return StepResult(start if reached is None else reached, terminate_requested=True)
        self._last_message = message
        details = "" if reached is None else f"; lastSuccessfulTime is {reached:.12g} s"
        raise self.status_error(function, status, details)


class Fmi3Api(FmiApi):
    """C functions of FMI 3.0."""

    major = 3
    state_word = "FMUState"
    instance_functions = {
        "co-simulation": ("fmi3InstantiateCoSimulation", "fmi3FreeInstance"),
        "model-exchange": ("fmi3InstantiateModelExchange", "fmi3FreeInstance"),
    }
    update_method = "updateDiscreteStates"
    model_functions = _MODEL_FUNCTIONS | {
        "get_derivatives": "GetContinuousStateDerivatives",
        "set_inputs": "SetFloat64",
    }

    def _create(self, logging_on: bool) -> None:
        """Instantiate the FMU.

        If it refuses Event Mode and early return, which it declares, it is instantiated without
        them.
        """
        is_refused = False
        while True:
            options = {}
            if self.description.interface == "co-simulation":
                options["eventModeUsed"] = self.uses_event_mode
                options["earlyReturnAllowed"] = self.may_return_early
            try:
                self._fmu.instantiate(loggingOn=logging_on, logMessage=self._log, **options)
                break
            except Exception:
                if not (self.uses_event_mode or self.may_return_early):
                    raise self.instantiation_error() from None
                is_refused, self.uses_event_mode, self.may_return_early = True, False, False
        if is_refused:
            text = (
                "declares hasEventMode or mightReturnEarlyFromDoStep, but could only be "
                "instantiated without them"
            )
            component_log.log_message(self.name, component_log.WARNING, text)

    def _log(self, _environment: Any, status: int, _category: Any, text: bytes) -> None:
        self.log(status, text)

    def _configure(self) -> None:
        self.call("enterConfigurationMode")
        for name, value in self.settings.structural_parameters.items():
            self.set_value(name, value)
        self.call("exitConfigurationMode")

    def enter_initialization(self, start_time: float, stop_time: float) -> None:
        """Call fmi3EnterInitializationMode."""
        self.current_time.value = start_time
        self.call("enterInitializationMode", self.tolerance, start_time, stop_time)

    def prepare_do_step(self, step_size: float, flags: StepFlags) -> list[PreparedCall]:
        """Prepare fmi3DoStep, and the check of the flags that it writes."""
        do_step = self.functions["fmi3DoStep"]
        first, reached = ctypes.addressof(flags.booleans), ctypes.addressof(flags.reached)
        native = NativeDoStep(3, function_address(do_step), self.handle, step_size, first, reached)
        arguments = (
            self.instance,
            self.current_time,
            as_double(step_size),
            ctypes.c_bool.from_param(True),
            *(as_pointer(first + i * ctypes.sizeof(ctypes.c_bool)) for i in range(3)),
            as_pointer(reached),
        )
        return [
            PreparedCall(do_step, arguments, "fmi3DoStep", native, (flags,)),
            PreparedCall(flags.check, (), STEP_FLAGS_CHECK, NativeFlagCheck(first), (flags,)),
        ]

    def count_states(self) -> tuple[int, int]:
        """Call the functions that return the numbers of states and event indicators."""
        return self._count("getNumberOfContinuousStates"), self._count("getNumberOfEventIndicators")

    def _count(self, method: str) -> int:
        """Return a number of the FMU.

        Raises:
            ComponentError: The call failed, or the number is too large.
        """
        found: int = self.call(method)
        if found > MAX_SCALARS:
            reason = f"found {found}, expected at most {MAX_SCALARS}"
            raise self.error(self.full_name(method), reason)
        return found

    # FMPy's own methods fail on null pointers, on texts that are not UTF-8 and on sizes beyond the
    # available memory

    def _get_strings(self, reference: int, count: int) -> Sequence[bytes | None]:
        texts = (ctypes.c_char_p * count)()
        references = (ctypes.c_uint32 * 1)(reference)
        self.call("fmi3GetString", self.handle, references, 1, texts, count)
        return list(texts)

    def _get_binaries(self, reference: int, count: int) -> list[bytes]:
        sizes, pointers = (ctypes.c_size_t * count)(), (ctypes.POINTER(ctypes.c_uint8) * count)()
        references = (ctypes.c_uint32 * 1)(reference)
        self.call("fmi3GetBinary", self.handle, references, 1, sizes, pointers, count)
        values = []
        for size, pointer in zip(sizes, pointers, strict=True):
            if size > MAX_BINARY_SIZE or (size and not pointer):
                found = f"{size} bytes" if pointer else f"{size} bytes at a null pointer"
                reason = f"found a binary of {found}, expected at most {MAX_BINARY_SIZE} bytes"
                raise self.error("fmi3GetBinary", reason)
            values.append(ctypes.string_at(pointer, size) if size else b"")
        return values


_APIS: dict[int, type[FmiApi]] = {1: Fmi1Api, 2: Fmi2Api, 3: Fmi3Api}


def _prepare_do_step(api: FmiApi, no_set_state: Any, step_size: float) -> PreparedCall:
    """Prepare doStep of FMI 1.0 or 2.0, which have the same arguments but another C Boolean."""
    do_step = api.functions[f"{api.c_prefix}DoStep"]
    arguments = (api.instance, api.current_time, as_double(step_size), no_set_state)
    native = NativeDoStep(2, function_address(do_step), api.handle, step_size)
    return PreparedCall(do_step, arguments, f"{api.prefix}DoStep", native)
