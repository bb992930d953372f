"""FMI 3.0 Co-Simulation, with neither event mode nor early return: a step either reaches its end or fails."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from ..component import DTYPES, Call, StepResult
from ..errors import ComponentError
from .instance import DISCARD, OK, FmuInstance, pointer

_ENDED = "how fmi3DoStep ended"


class Fmi3Instance(FmuInstance):
    """An instance of an FMI 3.0 FMU."""

    prefix = "fmi3"
    accessors = {name: name for name in DTYPES} | {"Enumeration": "Int64"}

    def _slave(self, **arguments: Any) -> Any:
        from fmpy.fmi3 import FMU3Slave

        return FMU3Slave(**arguments)

    def _instantiate(self) -> None:
        try:
            self._fmu.instantiate(loggingOn=self._logging_on, logMessage=lambda _, status, __, text: self.log(status, text))
        except Exception:
            reason = self._message or "the FMU gave no reason"
            raise ComponentError(self.name, "fmi3InstantiateCoSimulation", reason) from None

    def _access_arguments(self, references: Any, count: int, values: np.ndarray) -> tuple[Any, ...]:
        return references, ctypes.c_size_t(count), pointer(values), ctypes.c_size_t(len(values))

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._clock.value = start_time
        self.call("enterInitializationMode", None, start_time, stop_time)

    def _step_calls(self, step_size: ctypes.c_double) -> list[Call]:
        self._event, self._terminate, self._early = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool()
        self._reached = ctypes.c_double()
        results = (self._event, self._terminate, self._early, self._reached)
        arguments = (self._handle, self._clock, step_size, ctypes.c_bool(True), *map(_reference, results))
        return [Call(self._do_step, arguments, "fmi3DoStep"), Call(self._ended, (), _ENDED)]

    def _ended(self) -> int:
        """Discard stands for a step that is to be looked at: it ended early, met an event or asks to terminate."""
        return DISCARD if self._terminate or self._early or self._event else OK

    def failed(self, name: str, status: int) -> StepResult:
        if name == _ENDED:
            return StepResult(self._reached.value, self._event.value, self._terminate.value)
        self.fail(name, status)

    def get_state(self) -> Any:
        return self.call("getFMUState")

    def set_state(self, state: Any) -> None:
        self.call("setFMUState", state)

    def free_state(self, state: Any) -> None:
        self.call("freeFMUState", state)


def _reference(result: Any) -> Any:
    return ctypes.byref(result)
