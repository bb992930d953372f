"""FMU instances that run in the importer's process; common base of FMI 2.0 and FMI 3.0.

FMPy loads the library and makes the calls outside the stepping loop. In the stepping loop the C
functions are called directly with prepared arguments, because FMPy's own methods take 3 to 30 times
as long.
"""

from __future__ import annotations

import ctypes
import logging
from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import copy
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from ...core import component_log
from ...core.component import SUCCESS_STATUSES, Component, Ports, PreparedCall, StepResult
from ...core.errors import ComponentError
from ...process.journal import calling_component
from ...process.process_state import restoring_process_state
from . import log_callback
from .accessor_calls import AccessorCallFactory
from .file import FmuFile
from .function_calls import DISCARD, OK, FunctionCaller
from .library import MissingFunctionError, as_double, as_pointer, load_library
from .preflight.binary import version_deviations
from .preflight.platforms import EXPECTED_TEXTS
from .settings import InstanceSettings


class FmuInstance(FunctionCaller, Component):
    """Base of the FMI 2.0 and FMI 3.0 instances.

    Subclasses supply the C functions and their arguments.
    """

    binds_everything = False
    #: FMI major version
    major: int
    #: FMI 3.0 type names -> the part of fmi*Get..., fmi*Set... after Get and Set
    accessors: Mapping[str, str]
    #: end of the names of the C functions that save and restore the state
    _state_word: str
    #: name of the C function that creates an instance
    _instantiate_function: str
    #: name of the C function that frees it, if it is not fmi*FreeInstance
    _free_function = ""

    def __init__(self, file: FmuFile, instance_name: str, settings: InstanceSettings):
        """Create the component; see `create_component`.

        Raises:
            InputError: The FMU has errors or no usable binary for this platform.
        """
        super().__init__(file, instance_name)
        self.shared_code = file
        self.description = file.description.with_structural_parameters(
            settings.structural_parameters, file.limits
        )
        self.variables = self.description.variables
        self.has_state, self.variable_step = (
            self.description.has_state,
            self.description.variable_step,
        )
        self.continuous_states = self.description.continuous_states
        self.dependencies = self.description.dependencies
        self.initial_dependencies = self.description.initial_dependencies
        self.interpolates_inputs = self.description.interpolates_inputs
        self.gives_output_slopes = self.description.gives_output_slopes
        self._variables_by_name = {variable.name: variable for variable in self.variables}
        self._is_instantiated, self._has_acquired_file = False, False
        #: registration of the logger of FMI 1.0 and 2.0
        self._log_key = 0
        self._settings = settings
        self._logging_on = logging.getLogger(component_log.LOGGER_NAME).isEnabledFor(logging.DEBUG)
        #: relative tolerance that the FMU receives; None: none
        self.tolerance = settings.tolerance or self.description.default_experiment.tolerance
        file.check_binary()

    # -- what differs between the FMI versions
    # ---------------------------------------------------------------------------

    def _fmpy_class(self) -> type:
        """Import FMPy's class of a slave of this FMI version."""
        raise NotImplementedError

    def _instantiate_fmu(self, logging_on: bool) -> None:
        """Call fmi2Instantiate or fmi3InstantiateCoSimulation."""
        raise NotImplementedError

    def _get_strings(self, reference: int, count: int) -> Sequence[bytes | None]:
        """Return the values of a String variable, with None for null pointers."""
        raise NotImplementedError

    def _get_binaries(self, reference: int, count: int) -> list[bytes]:
        """Return the values of a Binary variable, a type that only FMI 3.0 has."""
        raise NotImplementedError

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        """Prepare doStep from `self._current_time`, with the step size as ctypes argument and in seconds."""
        raise NotImplementedError

    @property
    def _c_prefix(self) -> str:
        """Prefix of the C functions."""
        return self.prefix

    # -- life cycle
    # ------------------------------------------------------------------------------------------------------

    def instantiate(self) -> None:
        """Load the library, instantiate the FMU and prepare the calls that transfer the bound arrays.

        Raises:
            InputError: The library cannot be loaded.
            ComponentError: The FMU returned no instance.
        """
        folder = self._file.acquire()
        self._has_acquired_file = True
        is_loaded = self._file.library is not None
        with restoring_process_state(self.name):
            with calling_component(self.name, "loading the binary", "load"):
                self._fmu = self._copy_fmpy_slave(folder)
            if not is_loaded:
                self._check_version()
        logs_only_errors = bool(self.description.error_categories) and not self._logging_on
        self._hides_information = logs_only_errors
        with (
            restoring_process_state(self.name),
            calling_component(self.name, self._instantiate_function, "load"),
        ):
            self._instantiate_fmu(self._logging_on or logs_only_errors)
        if logs_only_errors:
            self._limit_log_to_errors()
        self._is_instantiated = True
        self._handle: int = self._fmu.component
        self._instance = as_pointer(self._handle)
        self._current_time = ctypes.c_double()
        self._set_structural_parameters()
        references, functions = self.description.value_references, self._fmu.functions
        self._prepare_transfers(
            AccessorCallFactory(
                self.major, self._c_prefix, functions, self._handle, references, self.accessors
            )
        )

    def _set_structural_parameters(self) -> None:
        """Set the structural parameters, which only FMI 3.0 has, in Configuration Mode."""

    def _prepare_transfers(self, factory: AccessorCallFactory) -> None:
        """Prepare the calls that transfer the bound arrays."""
        self._set_calls = factory.prepare(
            "Set", self._inputs, self._set_object, lambda v: not v.derivative_of
        )
        self._slope_calls = self._prepare_input_slopes(factory)
        self._get_calls = factory.prepare(
            "Get", self._outputs, self._get_object, lambda v: not v.derivative_of
        )
        self._output_slope_calls = factory.prepare(
            "Get", self._outputs, self._get_object, lambda v: bool(v.derivative_of)
        )

    def _prepare_input_slopes(self, factory: AccessorCallFactory) -> list[PreparedCall]:
        """Prepare the calls that set the time derivatives of inputs."""
        return factory.prepare(
            "Set", self._inputs, self._set_object, lambda v: bool(v.derivative_of)
        )

    def _copy_fmpy_slave(self, folder: Path) -> Any:
        """Return FMPy's slave object for this instance, a copy because creating one takes milliseconds."""
        if self._file.library is None:
            self._file.library = load_library(self._file, folder, self._fmpy_class())
        slave = copy(self._file.library)
        slave.instanceName = self.name
        return slave

    def _check_version(self) -> None:
        """Call fmi*GetVersion (and fmi2GetTypesPlatform), and log a warning about each unexpected return value."""
        texts = {}
        for name in (
            name
            for name in EXPECTED_TEXTS
            if name.startswith(self.prefix) and hasattr(self._fmu.dll, name)
        ):
            function = self._fmu.dll[name]
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

    def _instantiation_error(self) -> ComponentError:
        return ComponentError(
            self.name, self._instantiate_function, self._last_message or "the FMU gave no reason"
        )

    @property
    def has_fatal_error(self) -> bool:
        """True after any instance of this FMU has returned fatal."""
        return self._file.has_fatal_error

    def exit_initialization_mode(self) -> None:
        """Call fmi*ExitInitializationMode."""
        self.call_function("exitInitializationMode")
        self._enter_stepping()

    def _enter_stepping(self) -> None:
        """From now on calls have the deadline of steps, and outputs have time derivatives."""
        self._deadline_name = "step"
        self._get_calls = [*self._get_calls, *self._output_slope_calls]

    def terminate(self) -> None:
        """Call fmi*Terminate, unless an instance of the FMU has returned fatal."""
        self._deadline_name, self._current_time = (
            "end",
            ctypes.c_double(nan),
        )  # messages after the last step contain no time
        if not self._file.has_fatal_error:
            self.call_function("terminate")

    def free(self) -> None:
        """Call fmi*FreeInstance, unless an instance of the FMU has returned fatal, and release the FMU file."""
        if self._is_instantiated and not self._file.has_fatal_error:
            name = self._free_function or f"{self.prefix}FreeInstance"
            with calling_component(self.name, name, "end"):
                getattr(self._fmu, name)(self._handle)
        self._is_instantiated = False
        log_callback.unregister(self._log_key)
        if self._has_acquired_file:
            self._has_acquired_file = False
            with calling_component(self.name, "unloading the binary", "end"):
                self._file.release()

    # -- access outside the stepping loop
    # --------------------------------------------------------------------------------

    def set(self, name: str, value: Any) -> None:
        """Call the fmi*Set... function of the variable's type."""
        variable = self._variables_by_name[name]
        values = (
            np.array(value, object).ravel().tolist() if variable.shape else [value]
        )  # keeps all digits of 64-bit integers
        self.call_function(
            f"set{self.accessors[variable.type]}", [self.description.value_references[name]], values
        )

    def get(self, name: str) -> Any:
        """Call the fmi*Get... function of the variable's type."""
        variable = self._variables_by_name[name]
        reference, count = self.description.value_references[name], len(variable.scalar_names)
        values: Sequence[Any]
        if variable.type == "String":
            values = [
                self._decode_string(name, text) for text in self._get_strings(reference, count)
            ]
        elif variable.type == "Binary":
            values = self._get_binaries(reference, count)
        else:
            values = self.call_function(
                f"get{self.accessors[variable.type]}",
                [reference],
                *((count,) if variable.shape else ()),
            )
        return values if variable.shape else values[0]

    def _decode_string(self, name: str, text: bytes | None) -> str:
        if text is None:
            reason = f'the value of "{name}" is a null pointer, expected a text'
            raise ComponentError(
                self.name, f"{self.prefix}GetString", reason, self._current_time.value
            )
        return text.decode("utf-8", "replace")

    # -- the stepping loop
    # -----------------------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Store the arrays; `instantiate` prepares the calls that transfer them."""
        self._inputs, self._outputs = inputs, outputs

    def _set_object(self, name: str, array: np.ndarray, index: int) -> int:
        self.set(name, array[index])
        return OK

    def _get_object(self, name: str, array: np.ndarray, index: int) -> int:
        array[index] = self.get(name)
        return OK

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Prepare the fmi*Set..., fmi*DoStep and fmi*Get... calls of one step from `current_time` (s)."""
        self._current_time = current_time
        return [
            *self._set_calls,
            *self._slope_calls,
            *self._prepare_do_step(as_double(step_size), step_size),
            *self._get_calls,
        ]

    def set_inputs(self) -> None:
        """Call fmi*Set... for all bound inputs."""
        self._execute_calls(self._set_calls)

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Call fmi*DoStep."""
        self._current_time.value = time
        return self._execute_calls(
            [*self._slope_calls, *self._prepare_do_step(as_double(step_size), step_size)]
        )

    def get_outputs(self) -> None:
        """Call fmi*Get... for all bound outputs."""
        self._execute_calls(self._get_calls)

    def get_directional_derivative(
        self, outputs: Sequence[str], input_name: str
    ) -> Sequence[float] | None:
        """Call fmi*GetDirectionalDerivative.

        None for an FMU that does not provide it and for elements of arrays.
        """
        names = {input_name, *outputs}
        if (
            not self.description.directional_derivatives
            or not names <= self.description.value_references.keys()
        ):
            return None
        unknowns, known = (
            [self.description.value_references[name] for name in group]
            for group in (outputs, [input_name])
        )
        found: Sequence[float] | None = self.call_function(
            "getDirectionalDerivative", unknowns, known, [1.0], unavailable_status=DISCARD
        )
        return found

    def _execute_calls(self, calls: Sequence[PreparedCall]) -> StepResult | None:
        for call in calls:
            with calling_component(
                self.name, call.name, self._deadline_name, self._current_time.value
            ):
                status = call.function(*call.arguments)
            if status not in SUCCESS_STATUSES:
                return self.interpret_status(call.name, status)
            self.restore_float_mode(call.name)
        return None

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Raise the ComponentError for a bad status of a prepared call."""
        raise self.status_error(function, status)

    def get_state(self) -> Any:
        """Call fmi*GetFMUState."""
        return self.call_function(f"get{self._state_word}")

    def set_state(self, state: Any) -> None:
        """Call fmi*SetFMUState."""
        self.call_function(f"set{self._state_word}", state)

    def free_state(self, state: Any) -> None:
        """Call fmi*FreeFMUState."""
        self.call_function(f"free{self._state_word}", state)
