"""Protection of a PythonFMU class in an exported FMU: log of its own exceptions, and references to its entry module.

Exported FMUs contain a copy of this file. It imports only PythonFMU and the standard library.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

#: methods of a class that PythonFMU calls
_METHODS = (
    *("__init__", "setup_experiment", "enter_initialization_mode", "exit_initialization_mode", "do_step", "terminate"),
    *(f"{access}_{kind}" for access in ("get", "set") for kind in ("real", "integer", "boolean", "string")),
    *("_get_fmu_state", "_set_fmu_state"),
)
#: references to the globals of entry modules
_kept: list[object] = []


class SlaveError(Exception):
    """Exception that PythonFMU shows as its text alone."""

    def __repr__(self) -> str:
        """Return the text."""
        return str(self)


def with_exception_log(slave_class: type[Fmi2Slave]) -> type[Fmi2Slave]:
    """Return a subclass with the same name that logs class, text, file and line of each exception before it raises it."""
    methods = {name: _with_log(getattr(slave_class, name)) for name in _METHODS}
    return type(slave_class.__name__, (slave_class,), {**methods, "__doc__": slave_class.__doc__})


def keep_alive(module_globals: object) -> None:
    """Add a reference to the globals of the entry module.

    PythonFMU 0.7.0 executes the entry at each instantiation and then releases its globals once more than it acquired them.
    Without this reference, a later instantiation uses memory that is free.
    """
    _kept.append(module_globals)


def _with_log(method: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(method)
    def call(self: Fmi2Slave, *arguments: Any, **named: Any) -> Any:
        try:
            return method(self, *arguments, **named)
        except BaseException as error:
            text = _describe(error)
            if hasattr(self, "log_queue"):
                self.log(text, Fmi2Status.fatal, "logStatusFatal")
            raise SlaveError(text) from error

    return call


def _describe(error: BaseException) -> str:
    """Return class and text of an exception, with the innermost line in the files of this FMU."""
    folder = Path(__file__).parent
    frames = [frame for frame in traceback.extract_tb(error.__traceback__) if Path(frame.filename).is_relative_to(folder)]
    own = [frame for frame in frames if frame.filename != __file__ and Path(frame.filename).parent.name != "pythonfmu"]
    where = f" ({Path(own[-1].filename).name}:{own[-1].lineno})" if own else ""
    return f"{type(error).__name__}: {error}{where}"
