"""FMI 2.0 Co-Simulation."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.component import Call, DoStep, StepResult
from ...core.errors import ComponentError
from .c_functions import address
from .instance import DISCARD, FmuInstance

#: fmi2True
_TRUE = ctypes.c_int.from_param(1)
_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3


class Fmi2Instance(FmuInstance):
    """An instance of an FMI 2.0 FMU."""

    prefix, major = "fmi2", 2
    _instantiation = "fmi2Instantiate"
    accessors = {"Float64": "Real", "Int32": "Integer", "Enumeration": "Integer", "Boolean": "Boolean", "String": "String"}

    def _slave(self, **arguments: Any) -> Any:
        from fmpy.fmi2 import FMU2Slave

        return FMU2Slave(**arguments)

    def _instantiate(self) -> None:
        from fmpy import calloc, fmi2, free

        # fixed arity: the text is passed on as it is, printf directives in it are not expanded
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _, __, status, ___, text: self.log(status, text))
        callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(calloc)
        callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(free)
        try:
            self._fmu.instantiate(callbacks=callbacks, loggingOn=self._logging_on)
        except Exception:
            raise ComponentError(self.name, self._instantiation, self._message or "the FMU gave no reason") from None

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._clock.value = start_time
        self.call("setupExperiment", None, start_time, stop_time)
        self.call("enterInitializationMode")

    def _step_calls(self, step_size: Any, seconds: float) -> list[Call]:
        arguments = (self._instance, self._clock, step_size, _TRUE)
        native = DoStep(2, address(self._do_step), self._handle, seconds)
        return [Call(self._do_step, arguments, "fmi2DoStep", native)]

    def failed(self, name: str, status: int) -> StepResult:
        """Discard with `terminated` ends the simulation; every other bad status is a failure (FMI 2.0 section 4.2.1)."""
        if name != "fmi2DoStep" or status != DISCARD:
            self.fail(name, status)
        message, start = self._message, self._clock.value
        terminated = self.call("getBooleanStatus", _TERMINATED, no_answer=DISCARD)
        reached = self.call("getRealStatus", _LAST_SUCCESSFUL_TIME, no_answer=DISCARD)
        if terminated and (reached is None or reached >= start):
            return StepResult(start if reached is None else reached, terminate_requested=True)
        self._message = message
        self.fail(name, status, "" if reached is None else f"; it says that it came to t = {reached:.12g} s")

    def _texts(self, reference: int, count: int) -> Sequence[bytes | None]:
        texts: Sequence[bytes | None] = self.call("getString", [reference])
        return texts

    def get_state(self) -> Any:
        return self.call("getFMUstate")

    def set_state(self, state: Any) -> None:
        self.call("setFMUstate", state)

    def free_state(self, state: Any) -> None:
        self.call("freeFMUstate", state)
