"""FMI 2.0 Co-Simulation instances."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.component import NativeDoStep, PreparedCall, StepResult
from . import log_callback
from .function_calls import DISCARD
from .instance import FmuInstance
from .library import function_address
from .preflight.functions import ACCESSORS

#: fmi2True
_TRUE = ctypes.c_int.from_param(1)
#: values of fmi2StatusKind
_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3


class Fmi2Instance(FmuInstance):
    """Instance of an FMI 2.0 FMU."""

    prefix, major = "fmi2", 2
    _instantiate_function = "fmi2Instantiate"
    accessors = ACCESSORS[2]
    _state_word = "FMUstate"

    def _fmpy_class(self) -> type:
        from fmpy.fmi2 import FMU2Slave

        slave_class: type = FMU2Slave
        return slave_class

    def _instantiate_fmu(self, logging_on: bool) -> None:
        from fmpy import calloc, fmi2, free

        callbacks = fmi2.fmi2CallbackFunctions()
        self._log_key = log_callback.register(callbacks, self.name, self.log_message)
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        try:
            self._fmu.instantiate(callbacks=callbacks, loggingOn=logging_on)
        except Exception:
            raise self._instantiation_error() from None

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Call fmi2SetupExperiment and fmi2EnterInitializationMode."""
        self._current_time.value = start_time
        self.call_function("setupExperiment", self.tolerance, start_time, stop_time)
        self.call_function("enterInitializationMode")

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        do_step = self._fmu.functions["fmi2DoStep"]
        arguments = (self._instance, self._current_time, step_size, _TRUE)
        native = NativeDoStep(2, function_address(do_step), self._handle, seconds)
        return [PreparedCall(do_step, arguments, "fmi2DoStep", native)]

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Interpret a bad status.

        Fmi2Discard with `terminated` ends the simulation (FMI 2.0 section 4.2.1).

        Raises:
            ComponentError: For every other bad status.
        """
        if function != "fmi2DoStep" or status != DISCARD:
            raise self.status_error(function, status)
        message, start = self._last_message, self._current_time.value
        terminated = self.call_function("getBooleanStatus", _TERMINATED, unavailable_status=DISCARD)
        reached = self.call_function(
            "getRealStatus", _LAST_SUCCESSFUL_TIME, unavailable_status=DISCARD
        )
        if terminated and (reached is None or reached >= start):
            return StepResult(start if reached is None else reached, terminate_requested=True)
        self._last_message = message
        raise self.status_error(
            function, status, "" if reached is None else f"; lastSuccessfulTime is {reached:.12g} s"
        )

    def _get_strings(self, reference: int, _count: int) -> Sequence[bytes | None]:
        texts: Sequence[bytes | None] = self.call_function("getString", [reference])
        return texts
