"""FMI 3.0 Co-Simulation, with neither event mode nor early return: a step either reaches its end or fails."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.component import DTYPES, NativeDoStep, NativeFlagCheck, PreparedCall, StepResult
from ...core.errors import ComponentError
from .c_functions import as_pointer, function_address
from .instance import DISCARD, OK, FmuInstance

#: bytes of one binary value
MAX_BINARY_SIZE = 1 << 28

_TRUE = ctypes.c_bool.from_param(True)
_STEP_FLAGS_CHECK = "how fmi3DoStep ended"


class Fmi3Instance(FmuInstance):
    """An instance of an FMI 3.0 FMU."""

    prefix, major = "fmi3", 3
    _instantiate_function = "fmi3InstantiateCoSimulation"
    accessors = {name: name for name in DTYPES} | {"Enumeration": "Int64"}

    def _create_fmpy_slave(self, **arguments: Any) -> Any:
        from fmpy.fmi3 import FMU3Slave

        return FMU3Slave(**arguments)

    def _create_instance(self) -> None:
        try:
            self._fmu.instantiate(
                loggingOn=self._logging_on, logMessage=lambda _, status, __, text: self.log_message(status, text)
            )
        except Exception:
            reason = self._last_message or "the FMU gave no reason"
            raise ComponentError(self.name, self._instantiate_function, reason) from None

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._clock.value = start_time
        self.call_function("enterInitializationMode", None, start_time, stop_time)

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        # three flags and a byte, so that one look is enough
        self._step_flags, self._last_successful_time = (ctypes.c_bool * 4)(), ctypes.c_double()
        self._combined_flags = ctypes.c_uint32.from_buffer(self._step_flags)
        flags, reached = ctypes.addressof(self._step_flags), ctypes.addressof(self._last_successful_time)
        results = [as_pointer(flags + i * ctypes.sizeof(ctypes.c_bool)) for i in range(3)]
        arguments = (self._instance, self._clock, step_size, _TRUE, *results, as_pointer(reached))
        native = NativeDoStep(3, function_address(self._do_step), self._handle, seconds, flags, reached)
        kept = (self._step_flags, self._last_successful_time)
        return [
            PreparedCall(self._do_step, arguments, "fmi3DoStep", native, kept),
            PreparedCall(self._check_step_flags, (), _STEP_FLAGS_CHECK, NativeFlagCheck(flags), kept),
        ]

    def _check_step_flags(self) -> int:
        """Discard stands for a step that is to be looked at: it met an event, asks to terminate or ended early."""
        return DISCARD if self._combined_flags.value else OK

    def interpret_status(self, name: str, status: int) -> StepResult:
        if name == _STEP_FLAGS_CHECK:
            return self._step_result()
        self.raise_failure(name, status)

    def _step_result(self) -> StepResult:
        """What the last step came to; a time that is none or lies before the step must not pass for its end."""
        reached, start = self._last_successful_time.value, self._clock.value
        if not reached >= start:
            raise ComponentError(self.name, "fmi3DoStep", f"says that it ended at t = {reached!r} s", start)
        return StepResult(reached, self._step_flags[0], self._step_flags[1])

    # FMPy's own methods fail on null pointers, on texts that are not UTF-8 and on sizes beyond all memory

    def _get_strings(self, reference: int, count: int) -> Sequence[bytes | None]:
        texts = (ctypes.c_char_p * count)()
        self.call_function("fmi3GetString", self._handle, (ctypes.c_uint32 * 1)(reference), 1, texts, count)
        return list(texts)

    def _get_binaries(self, reference: int, count: int) -> list[bytes]:
        sizes, places = (ctypes.c_size_t * count)(), (ctypes.POINTER(ctypes.c_uint8) * count)()
        self.call_function("fmi3GetBinary", self._handle, (ctypes.c_uint32 * 1)(reference), 1, sizes, places, count)
        for size, place in zip(sizes, places, strict=True):
            if size > MAX_BINARY_SIZE or (size and not place):
                found = f"{size} bytes" if place else f"{size} bytes at a null pointer"
                reason = f"found a binary of {found}, expected at most {MAX_BINARY_SIZE} bytes"
                raise ComponentError(self.name, "fmi3GetBinary", reason, self._clock.value)
        return [ctypes.string_at(place, size) if size else b"" for size, place in zip(sizes, places, strict=True)]

    def get_state(self) -> Any:
        return self.call_function("getFMUState")

    def set_state(self, state: Any) -> None:
        self.call_function("setFMUState", state)

    def free_state(self, state: Any) -> None:
        self.call_function("freeFMUState", state)
