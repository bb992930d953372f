"""An instance of an FMU as a component.

FMPy loads the library and walks the life cycle; on the hot path the C functions are called directly, with arguments that
were made beforehand (FMPy's own methods cost 3 to 30 times as much).
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from copy import copy
from itertools import groupby
from math import isnan, nan
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ...core import component_log
from ...core.component import SUCCESS_STATUSES, Component, NativeGetSet, Ports, PreparedCall, StepResult, Variable
from ...core.errors import ComponentError, InputError
from ...process import float_mode
from ...process.journal import calling_component
from ...process.process_state import restoring_process_state
from .c_functions import FunctionTable, as_double, as_pointer, as_size, function_address
from .file import FmuFile

STATUS_NAMES = ("OK", "warning", "discard", "error", "fatal", "pending")
OK, WARNING, DISCARD, ERROR, FATAL = range(5)


class FmuInstance(Component):
    """What FMI 2.0 and 3.0 have in common. Subclasses name the C functions and lay out their arguments."""

    binds_everything = False
    #: prefix of the C functions
    prefix: str
    major: int
    #: cosim type -> the part of fmi*Get..., fmi*Set... after Get and Set
    accessors: Mapping[str, str]

    def __init__(self, file: FmuFile, instance_name: str, logging_on: bool):
        self.name, self._file, self.shared_code = instance_name, file, file
        self.description = file.description
        self.variables = self.description.variables
        self.has_state = self.description.has_state
        self._variables_by_name = {variable.name: variable for variable in self.variables}
        self._last_message = ""
        self._clock = ctypes.c_double()
        #: instantiated, and neither freed nor corrupt
        self._is_instantiated, self._holds_folder = False, False
        #: the deadline of calls that are not steps
        self._deadline_name = "initialization"
        self._logging_on = logging_on
        self._fmu: Any = None
        file.check_binary()

    # -- what differs between the FMI versions -------------------------------------------------------------------------

    def _create_fmpy_slave(self, **arguments: Any) -> Any:
        raise NotImplementedError

    def _create_instance(self) -> None:
        raise NotImplementedError

    def _get_strings(self, reference: int, count: int) -> Sequence[bytes | None]:
        """The values of a string variable; None for null pointers."""
        raise NotImplementedError

    def _get_binaries(self, reference: int, count: int) -> list[bytes]:
        """The values of a binary variable, which only FMI 3.0 knows."""
        raise NotImplementedError

    #: the C function that makes an instance
    _instantiate_function: str

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        """doStep from the time in `self._clock`."""
        raise NotImplementedError

    # -- life cycle ----------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Load the library, create the FMU instance and prepare the calls that transfer the bound arrays.

        Raises:
            InputError: The binary cannot be loaded.
            ComponentError: The FMU refuses to be instantiated.
        """
        folder = self._file.acquire()
        self._holds_folder = True
        with restoring_process_state(self.name), calling_component(self.name, "loading the binary", "load"):
            self._fmu = self._fmpy_instance(folder)
        with restoring_process_state(self.name), calling_component(self.name, self._instantiate_function, "load"):
            self._create_instance()
        self._is_instantiated = True
        self._handle: int = self._fmu.component
        self._do_step = self._fmu.functions[f"{self.prefix}DoStep"]
        self._instance = as_pointer(self._handle)
        self._clock, self._step_size = ctypes.c_double(), ctypes.c_double()
        self._do_step_calls = self._prepare_do_step(self._step_size, 0.0)
        self._set_calls = self._prepare_accessors("Set", self._inputs)
        self._get_calls = self._prepare_accessors("Get", self._outputs)

    def _fmpy_instance(self, folder: Path) -> Any:
        """FMPy's object for this instance: a copy of one that is made once for all instances, which takes milliseconds."""
        if self._file.library is None:
            self._file.library = self._load_library(folder)
            self._file.library.functions = FunctionTable(self._file.library.dll)
        fmu = copy(self._file.library)
        fmu.instanceName = self.name
        return fmu

    def _load_library(self, folder: Path) -> Any:
        description = self.description
        try:
            fmu = self._create_fmpy_slave(
                guid=description.instantiation_token, modelIdentifier=description.model_identifier, unzipDirectory=str(folder)
            )
        except Exception as error:
            reason = str(error).replace(f"{folder}/", "")
            raise InputError(f'the binary of "{self._file.path}" cannot be loaded: {reason}') from None
        for function in fmu._functions.values():
            if function.restype is ctypes.c_int:
                function.errcheck = _reject_negative_status
        return fmu

    def call_function(self, function: str, *arguments: Any, unavailable_status: int | None = None) -> Any:
        """Call one of FMPy's methods, or a C function by its whole name.

        A bad status becomes a ComponentError with the FMU's own last message, but for the status that means `no_answer`: None.
        """
        from fmpy.fmi1 import FMICallException

        name = function if function.startswith(self.prefix) else self.prefix + function[0].upper() + function[1:]
        with calling_component(self.name, name, self._deadline_name, self._clock.value):
            try:
                result = getattr(self._fmu, function)(*arguments)
            except FMICallException as error:
                if error.status == unavailable_status:
                    return None
                self.raise_failure(error.function, error.status)
        self._check_float_mode(name)
        return result

    def _check_float_mode(self, function: str) -> None:
        if float_mode.is_changed() or float_mode.enabled_traps():
            raise ComponentError(self.name, function, float_mode.CHANGE_REASON, self._clock.value)

    def raise_failure(self, function: str, status: int, details: str = "") -> NoReturn:
        """Raise the error for a status; `more` is said at its end.

        After fatal nothing of any instance of this FMU may be called (FMI 3.0 section 2.2.3).
        """
        self._file.has_fatal_error = self._file.has_fatal_error or status == FATAL
        label = STATUS_NAMES[status] if 0 <= status < len(STATUS_NAMES) else "not defined by FMI"
        reason = f"status {status} ({label})" + (f": {self._last_message}" if self._last_message else "") + details
        raise ComponentError(self.name, function, reason, None if isnan(self._clock.value) else self._clock.value)

    def log_message(self, status: int, text: bytes | None) -> None:
        """A message from the FMU: kept as the reason of a later failure, and passed on to the user."""
        self._last_message = (text or b"").decode("utf-8", "replace").strip()
        level = (
            component_log.INFO if status == OK else component_log.WARNING if status in (WARNING, DISCARD) else component_log.ERROR
        )
        component_log.log_message(self.name, level, self._last_message)

    @property
    def has_fatal_error(self) -> bool:
        """A fatal error was reported by an instance of this FMU."""
        return self._file.has_fatal_error

    def exit_initialization_mode(self) -> None:
        self.call_function("exitInitializationMode")
        self._deadline_name = "step"

    def terminate(self) -> None:
        self._deadline_name, self._clock = "end", ctypes.c_double(nan)  # the simulation is over: its time says nothing any more
        if not self._file.has_fatal_error:
            self.call_function("terminate")

    def free(self) -> None:
        if self._is_instantiated and not self._file.has_fatal_error:
            with calling_component(self.name, f"{self.prefix}FreeInstance", "end"):
                getattr(self._fmu, f"{self.prefix}FreeInstance")(self._handle)
        self._is_instantiated = False
        if self._holds_folder:
            self._holds_folder = False
            with calling_component(self.name, "unloading the binary", "end"):
                self._file.release()

    # -- access off the hot path ---------------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        variable = self._variables_by_name[name]
        values = list(np.ravel(value)) if variable.shape else [value]
        self.call_function(f"set{self.accessors[variable.type]}", [self.description.value_references[name]], values)

    def get(self, name: str) -> Any:
        variable = self._variables_by_name[name]
        reference, count = self.description.value_references[name], len(variable.scalar_names)
        values: Sequence[Any]
        if variable.type == "String":
            values = [self._decode_string(name, text) for text in self._get_strings(reference, count)]
        elif variable.type == "Binary":
            values = self._get_binaries(reference, count)
        else:
            values = self.call_function(f"get{self.accessors[variable.type]}", [reference], *((count,) if variable.shape else ()))
        return values if variable.shape else values[0]

    def _decode_string(self, name: str, text: bytes | None) -> str:
        if text is None:
            reason = f'the value of "{name}" is a null pointer, expected a text'
            raise ComponentError(self.name, f"{self.prefix}GetString", reason, self._clock.value)
        return text.decode("utf-8", "replace")

    # -- the hot path --------------------------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._inputs, self._outputs = inputs, outputs

    def _prepare_accessors(self, verb: str, ports: Ports) -> list[PreparedCall]:
        """One call for each run of variables with the same accessor; strings and binaries go one by one."""
        calls: list[PreparedCall] = []
        move = self._set_object if verb == "Set" else self._get_object
        for dtype, array in ports.arrays.items():
            place = 0
            own = [variable for variable in ports.variables if variable.dtype == dtype]
            for accessor, run in groupby(own, lambda variable: self.accessors[variable.type]):
                variables = list(run)
                size = sum(len(variable.scalar_names) for variable in variables)
                if dtype.hasobject:
                    name = f"{self.prefix}{verb}{accessor}"
                    calls += [PreparedCall(move, (v.name, array, place + i), name) for i, v in enumerate(variables)]
                else:
                    calls.append(self._prepare_accessor(f"{self.prefix}{verb}{accessor}", variables, array[place : place + size]))
                place += size
        return calls

    def _set_object(self, name: str, array: np.ndarray, index: int) -> int:
        self.set(name, array[index])
        return OK

    def _get_object(self, name: str, array: np.ndarray, index: int) -> int:
        array[index] = self.get(name)
        return OK

    def _prepare_accessor(self, function: str, variables: Sequence[Variable], values: np.ndarray) -> PreparedCall:
        references = (ctypes.c_uint32 * len(variables))(*(self.description.value_references[v.name] for v in variables))
        bound = self._fmu.functions[function]
        pointers = (self._handle, ctypes.addressof(references), values.ctypes.data)
        arguments: tuple[Any, ...] = (self._instance, as_pointer(pointers[1]), as_size(len(variables)), as_pointer(pointers[2]))
        if self.major > 2:
            arguments += (as_size(len(values)),)
        native = NativeGetSet(self.major, function_address(bound), *pointers[:2], len(variables), pointers[2], len(values))
        return PreparedCall(bound, arguments, function, native, (references, values))

    def prepare_step_calls(self, clock: ctypes.c_double, step_size: float) -> Sequence[PreparedCall]:
        self._clock = clock
        return [*self._set_calls, *self._prepare_do_step(as_double(step_size), step_size), *self._get_calls]

    def set_inputs(self) -> None:
        self._execute_calls(self._set_calls)

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        self._clock.value, self._step_size.value = time, step_size
        return self._execute_calls(self._do_step_calls)

    def get_outputs(self) -> None:
        self._execute_calls(self._get_calls)

    def _execute_calls(self, calls: Sequence[PreparedCall]) -> StepResult | None:
        for call in calls:
            with calling_component(self.name, call.name, self._deadline_name, self._clock.value):
                status = call.function(*call.arguments)
            if status not in SUCCESS_STATUSES:
                return self.interpret_status(call.name, status)
            self._check_float_mode(call.name)
        return None

    def interpret_status(self, name: str, status: int) -> StepResult:
        self.raise_failure(name, status)


def _reject_negative_status(status: int, function: Any, _: Any) -> int:
    """FMPy alone would take negative numbers for good statuses."""
    from fmpy.fmi1 import FMICallException

    if status < 0:
        raise FMICallException(function.__name__, status)
    return status
