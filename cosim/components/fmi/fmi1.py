"""FMI 1.0 Co-Simulation instances.

FMI 1.0 has no initialization mode: fmiInitializeSlave ends the initialization, and inputs can be
set and outputs be read only afterwards. Therefore the start values of inputs are those of the FMU
while it is initialized, and the values of connected outputs follow before the first step.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from ...core.component import NativeDoStep, PreparedCall, StepResult
from . import log_callback
from .accessor_calls import AccessorCallFactory
from .function_calls import DISCARD, OK
from .instance import FmuInstance
from .library import function_address
from .preflight.functions import ACCESSORS

#: fmiTrue
_TRUE = ctypes.c_char.from_param(1)
#: value of fmiStatusKind
_LAST_SUCCESSFUL_TIME = 2


class Fmi1Instance(FmuInstance):
    """Instance of an FMI 1.0 FMU."""

    prefix, major = "fmi1", 1
    _instantiate_function, _free_function = "fmi1InstantiateSlave", "fmi1FreeSlaveInstance"
    accessors = ACCESSORS[1]

    @property
    def _c_prefix(self) -> str:
        return f"{self.description.model_identifier}_fmi"

    def _fmpy_class(self) -> type:
        from fmpy.fmi1 import FMU1Slave

        slave_class: type = FMU1Slave
        return slave_class

    def _instantiate_fmu(self, logging_on: bool) -> None:
        from fmpy import calloc, fmi1, free

        callbacks = fmi1.fmi1CallbackFunctions()
        self._log_key = log_callback.register(callbacks, self.name, self.log_message)
        callbacks.allocateMemory = fmi1.fmi1CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi1.fmi1CallbackFreeMemoryTYPE(free)
        with suppress(Exception):  # FMPy's exception of a null pointer has no reason
            self._fmu.instantiate(functions=callbacks, loggingOn=logging_on)
        if not self._fmu.component:
            raise self._instantiation_error()

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Call fmiInitializeSlave."""
        self._current_time.value = start_time
        self.call_function("initialize", start_time, stop_time)

    def exit_initialization_mode(self) -> None:
        """Do nothing in the FMU, which is in step mode since fmiInitializeSlave."""
        self._enter_stepping()

    def _prepare_transfers(self, factory: AccessorCallFactory) -> None:
        super()._prepare_transfers(factory)
        begins = dict.fromkeys(self._outputs.arrays, 0)
        for variable in self._outputs.variables:
            if variable.name in self.description.negated:
                arguments = (self._outputs.arrays[variable.dtype], begins[variable.dtype])
                self._get_calls.append(PreparedCall(_negate_element, arguments, "negated alias"))
            begins[variable.dtype] += 1

    def get(self, name: str) -> Any:
        """Call the fmiGet... function of the variable's type.

        A negated alias has the opposite sign.
        """
        value = super().get(name)
        if name not in self.description.negated:
            return value
        return not value if self._variables_by_name[name].type == "Boolean" else -value

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        do_step = self._fmu.functions[f"{self._c_prefix}DoStep"]
        native = NativeDoStep(2, function_address(do_step), self._handle, seconds)
        return [
            PreparedCall(
                do_step,
                (self._instance, self._current_time, step_size, _TRUE),
                "fmi1DoStep",
                native,
            )
        ]

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Raise the ComponentError for a bad status, with the time that a discarded step reached."""
        details = ""
        if function == "fmi1DoStep" and status == DISCARD:
            message = self._last_message
            reached = self.call_function(
                "getRealStatus", _LAST_SUCCESSFUL_TIME, unavailable_status=DISCARD
            )
            details, self._last_message = (
                "" if reached is None else f"; lastSuccessfulTime is {reached.value:.12g} s",
                message,
            )
        raise self.status_error(function, status, details)

    def _get_strings(self, reference: int, _count: int) -> Sequence[bytes | None]:
        texts: Sequence[bytes | None] = self.call_function("getString", [reference])
        return texts


def _negate_element(array: np.ndarray, index: int) -> int:
    array[index] = not array[index] if array.dtype == np.bool_ else -array[index]
    return OK
