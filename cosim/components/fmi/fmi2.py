"""FMI 2.0 Co-Simulation."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.component import NativeDoStep, PreparedCall, StepResult
from ...core.errors import ComponentError
from .c_functions import function_address
from .instance import DISCARD, FmuInstance

#: fmi2True
_TRUE = ctypes.c_int.from_param(1)
_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3


class Fmi2Instance(FmuInstance):
    """An instance of an FMI 2.0 FMU."""

    prefix, major = "fmi2", 2
    _instantiate_function = "fmi2Instantiate"
    accessors = {"Float64": "Real", "Int32": "Integer", "Enumeration": "Integer", "Boolean": "Boolean", "String": "String"}

    def _create_fmpy_slave(self, **arguments: Any) -> Any:
        from fmpy.fmi2 import FMU2Slave

        return FMU2Slave(**arguments)

    def _create_instance(self) -> None:
        from fmpy import calloc, fmi2, free

        # fixed arity: the text is passed on as it is, printf directives in it are not expanded
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _, __, status, ___, text: self.log_message(status, text))
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        try:
            self._fmu.instantiate(callbacks=callbacks, loggingOn=self._logging_on)
        except Exception:
            raise ComponentError(self.name, self._instantiate_function, self._last_message or "the FMU gave no reason") from None

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._clock.value = start_time
        self.call_function("setupExperiment", None, start_time, stop_time)
        self.call_function("enterInitializationMode")

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        arguments = (self._instance, self._clock, step_size, _TRUE)
        native = NativeDoStep(2, function_address(self._do_step), self._handle, seconds)
        return [PreparedCall(self._do_step, arguments, "fmi2DoStep", native)]

    def interpret_status(self, name: str, status: int) -> StepResult:
        """Discard with `terminated` ends the simulation; every other bad status is a failure (FMI 2.0 section 4.2.1)."""
        if name != "fmi2DoStep" or status != DISCARD:
            self.raise_failure(name, status)
        message, start = self._last_message, self._clock.value
        terminated = self.call_function("getBooleanStatus", _TERMINATED, unavailable_status=DISCARD)
        reached = self.call_function("getRealStatus", _LAST_SUCCESSFUL_TIME, unavailable_status=DISCARD)
        if terminated and (reached is None or reached >= start):
            return StepResult(start if reached is None else reached, terminate_requested=True)
        self._last_message = message
        self.raise_failure(name, status, "" if reached is None else f"; it says that it came to t = {reached:.12g} s")

    def _get_strings(self, reference: int, count: int) -> Sequence[bytes | None]:
        texts: Sequence[bytes | None] = self.call_function("getString", [reference])
        return texts

    def get_state(self) -> Any:
        return self.call_function("getFMUstate")

    def set_state(self, state: Any) -> None:
        self.call_function("setFMUstate", state)

    def free_state(self, state: Any) -> None:
        self.call_function("freeFMUstate", state)
