"""Calls of FMI functions outside the stepping loop, with their statuses, log messages and errors."""

from __future__ import annotations

import ctypes
from math import isnan
from typing import Any

from ...core import component_log
from ...core.errors import ComponentError
from ...process import float_mode
from ...process.journal import calling_component
from .file import FmuFile
from .library import MissingFunctionError

#: names of fmi2Status and fmi3Status by value; "pending" exists in FMI 2.0 only
STATUS_NAMES = ("OK", "warning", "discard", "error", "fatal", "pending")
OK, WARNING, DISCARD, ERROR, FATAL = range(5)
_LOG_LEVELS = {
    OK: component_log.INFO,
    WARNING: component_log.WARNING,
    DISCARD: component_log.WARNING,
}


class FunctionCaller:
    """Caller of the FMI functions of one FMU instance."""

    #: prefix of the C functions, "fmi2" or "fmi3"
    prefix: str

    def __init__(self, file: FmuFile, instance_name: str):
        self.name, self._file = instance_name, file
        #: FMPy's slave object of this instance
        self._fmu: Any = None
        self._last_message = ""
        #: ignore messages with status OK
        self._hides_information = False
        #: name of the deadline (see `Deadlines`) of the calls in the present phase of the life
        #: cycle
        self._deadline_name = "initialization"
        #: communication point at which the next step starts (s); doStep reads it
        self._current_time = ctypes.c_double()
        self._float_mode = float_mode.FloatModeGuard()

    def call_function(
        self, function: str, *arguments: Any, unavailable_status: int | None = None
    ) -> Any:
        """Call an FMI function outside the stepping loop.

        Args:
            function: Name of FMPy's method, such as "getReal", or full name of a C function, such
                as "fmi3GetString".
            *arguments: Arguments of the function.
            unavailable_status: Status that means that no value is available.

        Returns:
            The result of the function, or None for `unavailable_status`.

        Raises:
            ComponentError: The function returned a bad status, or the library does not export it.
        """
        from fmpy.fmi1 import FMICallException

        name = self._full_name(function)
        with calling_component(self.name, name, self._deadline_name, self._current_time.value):
            try:
                result = getattr(self._fmu, function)(*arguments)
            except FMICallException as error:
                if error.status == unavailable_status:
                    return None
                raise self.status_error(error.function, error.status) from None
            except MissingFunctionError:
                if unavailable_status is not None:
                    return None
                raise ComponentError(
                    self.name, name, "the library does not export this function"
                ) from None
        self.restore_float_mode(name)
        return result

    def _full_name(self, function: str) -> str:
        """Return the name of the C function for FMPy's method, such as "getReal", or for its own name."""
        return (
            function
            if function.startswith(self.prefix)
            else self.prefix + function[0].upper() + function[1:]
        )

    def restore_float_mode(self, function: str) -> None:
        """Restore the default floating-point mode if the last call, which was a call of `function`, changed it."""
        if float_mode.is_changed() or float_mode.enabled_traps():
            self._float_mode.restore(self.name, function, self._current_time.value)

    def status_error(self, function: str, status: int, details: str = "") -> ComponentError:
        """Return the error for a bad status, with the FMU's last log message and `details` at its end.

        After fatal no function of any instance of this FMU may be called (FMI 3.0 section 2.2.3).
        """
        self._file.has_fatal_error = self._file.has_fatal_error or status == FATAL
        label = STATUS_NAMES[status] if 0 <= status < len(STATUS_NAMES) else "not defined by FMI"
        reason = (
            f"status {status} ({label})"
            + (f": {self._last_message}" if self._last_message else "")
            + details
        )
        return ComponentError(
            self.name,
            function,
            reason,
            None if isnan(self._current_time.value) else self._current_time.value,
        )

    def log_message(self, status: int, text: bytes | None) -> None:
        """Forward a log message of the FMU to the log, and keep it as the reason of a later failure."""
        if status == OK and self._hides_information:
            return
        self._last_message = (text or b"").decode("utf-8", "replace").strip()
        component_log.log_message(
            self.name, _LOG_LEVELS.get(status, component_log.ERROR), self._last_message
        )
