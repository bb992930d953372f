"""FMI 3.0 instances: the functions that Co-Simulation and Model Exchange share, and fmi3DoStep."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

from ...core.component import NativeDoStep, NativeFlagCheck, PreparedCall, StepResult
from ...core.errors import ComponentError
from .function_calls import DISCARD, OK
from .instance import FmuInstance
from .library import as_pointer, function_address
from .preflight.functions import ACCESSORS

#: largest accepted size of one Binary value (bytes)
MAX_BINARY_SIZE = 1 << 28

_TRUE = ctypes.c_bool.from_param(True)
#: name of the prepared call that follows fmi3DoStep
STEP_FLAGS_CHECK = "fmi3DoStep (returned flags)"


class Fmi3Instance(FmuInstance):
    """Instance of an FMI 3.0 FMU."""

    prefix, major = "fmi3", 3
    _instantiate_function = "fmi3InstantiateCoSimulation"
    accessors = ACCESSORS[3]
    _state_word = "FMUState"

    def _fmpy_class(self) -> type:
        from fmpy.fmi3 import FMU3Slave

        slave_class: type = FMU3Slave
        return slave_class

    def _instantiation_options(self) -> dict[str, bool]:
        """Return further arguments of the instantiation."""
        return {}

    def _instantiate_fmu(self, logging_on: bool) -> None:
        def log(_: Any, status: int, __: Any, text: bytes) -> None:
            self.log_message(status, text)

        try:
            self._fmu.instantiate(
                loggingOn=logging_on, logMessage=log, **self._instantiation_options()
            )
        except Exception:
            raise self._instantiation_error() from None

    def _set_structural_parameters(self) -> None:
        if not self._settings.structural_parameters:
            return
        self.call_function("enterConfigurationMode")
        for name, value in self._settings.structural_parameters.items():
            super().set(name, value)
        self.call_function("exitConfigurationMode")

    def set(self, name: str, value: Any) -> None:
        """Set a variable, except structural parameters, which already have their values."""
        if self._variables_by_name[name].causality != "structuralParameter":
            super().set(name, value)

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Call fmi3EnterInitializationMode."""
        self._current_time.value = start_time
        self.call_function("enterInitializationMode", self.tolerance, start_time, stop_time)

    def _prepare_do_step(self, step_size: Any, seconds: float) -> list[PreparedCall]:
        do_step = self._fmu.functions["fmi3DoStep"]
        # three Booleans and one unused byte, so that one 32-bit read covers all flags
        self._step_flags, self._last_successful_time = (ctypes.c_bool * 4)(), ctypes.c_double()
        self._combined_flags = ctypes.c_uint32.from_buffer(self._step_flags)
        flags, reached = (
            ctypes.addressof(self._step_flags),
            ctypes.addressof(self._last_successful_time),
        )
        results = [as_pointer(flags + i * ctypes.sizeof(ctypes.c_bool)) for i in range(3)]
        arguments = (
            self._instance,
            self._current_time,
            step_size,
            _TRUE,
            *results,
            as_pointer(reached),
        )
        native = NativeDoStep(3, function_address(do_step), self._handle, seconds, flags, reached)
        keep_alive = (self._step_flags, self._last_successful_time)
        return [
            PreparedCall(do_step, arguments, "fmi3DoStep", native, keep_alive),
            PreparedCall(
                self._check_step_flags, (), STEP_FLAGS_CHECK, NativeFlagCheck(flags), keep_alive
            ),
        ]

    def _check_step_flags(self) -> int:
        """Return discard if fmi3DoStep set eventHandlingNeeded, terminateSimulation or earlyReturn."""
        return DISCARD if self._combined_flags.value else OK

    def _step_result(self, begin: float) -> StepResult:
        """Return the result of fmi3DoStep from `begin` (s).

        A lastSuccessfulTime that is NaN or before it is an error.
        """
        reached = self._last_successful_time.value
        if not reached >= begin:
            reason = f"lastSuccessfulTime is {reached!r} s, expected at least the start of the step"
            raise ComponentError(self.name, "fmi3DoStep", reason, begin)
        return StepResult(reached, self._step_flags[0], self._step_flags[1])

    # FMPy's own methods fail on null pointers, on texts that are not UTF-8 and on sizes beyond the
    # available memory

    def _get_strings(self, reference: int, count: int) -> Sequence[bytes | None]:
        texts = (ctypes.c_char_p * count)()
        self.call_function(
            "fmi3GetString", self._handle, (ctypes.c_uint32 * 1)(reference), 1, texts, count
        )
        return list(texts)

    def _get_binaries(self, reference: int, count: int) -> list[bytes]:
        sizes, pointers = (ctypes.c_size_t * count)(), (ctypes.POINTER(ctypes.c_uint8) * count)()
        self.call_function(
            "fmi3GetBinary",
            self._handle,
            (ctypes.c_uint32 * 1)(reference),
            1,
            sizes,
            pointers,
            count,
        )
        for size, pointer in zip(sizes, pointers, strict=True):
            if size > MAX_BINARY_SIZE or (size and not pointer):
                found = f"{size} bytes" if pointer else f"{size} bytes at a null pointer"
                reason = f"found a binary of {found}, expected at most {MAX_BINARY_SIZE} bytes"
                raise ComponentError(self.name, "fmi3GetBinary", reason, self._current_time.value)
        return [
            ctypes.string_at(pointer, size) if size else b""
            for size, pointer in zip(sizes, pointers, strict=True)
        ]
