"""FMI 3.0 Co-Simulation, with neither event mode nor early return: a step either reaches its end or fails."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from ..component import DTYPES, StepResult
from ..errors import ComponentError
from .instance import FmuInstance, pointer


class Fmi3Instance(FmuInstance):
    """An instance of an FMI 3.0 FMU."""

    prefix = "fmi3"
    accessors = {name: name for name in DTYPES} | {"Enumeration": "Int64"}

    def _prepare_step(self, do_step: Any) -> None:
        self._do_step = do_step
        self._time, self._step_size = ctypes.c_double(), ctypes.c_double()
        self._event, self._terminate, self._early = ctypes.c_bool(), ctypes.c_bool(), ctypes.c_bool()
        self._reached = ctypes.c_double()
        flags = [ctypes.byref(flag) for flag in (self._event, self._terminate, self._early)]
        held = (self._handle, self._time, self._step_size, ctypes.c_bool(True))
        self._step_arguments = (*held, *flags, ctypes.byref(self._reached))

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
        self._now = start_time
        self.call("enterInitializationMode", None, start_time, stop_time)

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        self._time.value = self._now = time
        self._step_size.value = step_size
        status = self._do_step(*self._step_arguments)
        if status > 1:
            self.fail("fmi3DoStep", status)
        if self._terminate or self._early or self._event:
            return StepResult(self._reached.value, self._event.value, self._terminate.value)
        return None

    def get_state(self) -> Any:
        return self.call("getFMUState")

    def set_state(self, state: Any) -> None:
        self.call("setFMUState", state)

    def free_state(self, state: Any) -> None:
        self.call("freeFMUState", state)
