"""Protection of a PythonFMU class in an exported FMU.

Its import, a log of its exceptions, and its whole state.

Exported FMUs contain copies of this file and of `object_state.py`. They import only PythonFMU and
the standard library.
"""

import importlib
import sys
import traceback
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from .object_state import Restore, snapshot

#: methods of a class that PythonFMU calls
_METHODS = (
    "__init__",
    "setup_experiment",
    "enter_initialization_mode",
    "exit_initialization_mode",
    "do_step",
    "terminate",
    *(f"get_{kind}" for kind in ("real", "integer", "boolean", "string")),
    *(f"set_{kind}" for kind in ("real", "integer", "boolean", "string")),
    "_get_fmu_state",
    "_set_fmu_state",
)
#: attributes of a slave that belong to PythonFMU and are no state
PYTHONFMU_ATTRIBUTES = frozenset({"vars", "log_queue"})
#: references to the globals of entry modules
_kept: list[object] = []


class SlaveError(Exception):
    """Exception that PythonFMU shows as its text alone."""

    def __repr__(self) -> str:
        """Return the text."""
        return str(self)


def protected_class(slave_class: type[Fmi2Slave]) -> type[Fmi2Slave]:
    """Return a subclass with the same name.

    It logs class, text, file and line of each exception before it raises it. Its states contain all
    attributes of the object, not only the registered variables, unless the class overrides
    `_get_fmu_state`.
    """
    methods = {name: _with_log(getattr(slave_class, name)) for name in _METHODS}
    if slave_class._get_fmu_state is Fmi2Slave._get_fmu_state:
        methods |= {
            "_get_fmu_state": _with_log(_get_state),
            "_set_fmu_state": _with_log(_set_state),
        }
    return type(slave_class.__name__, (slave_class,), {**methods, "__doc__": slave_class.__doc__})


def load_class(entry: dict[str, Any], source: str, name: str) -> type[Fmi2Slave]:
    """Import the class of an FMU from its folder, and return it with a log of its exceptions.

    PythonFMU executes the entry module at each instantiation, but imports it only once in a
    process. If the folder that it was imported from has been removed since, the modules are
    imported again from the folder of the present instance.

    PythonFMU 0.7.0 also releases the globals of the entry once more than it acquired them, which
    the reference in `_kept` compensates. Otherwise a later instantiation uses memory that is free.

    Args:
        entry: Globals of the entry module, a package.
        source: Name of the source, a member of the package.
        name: Name of the class.
    """
    _kept.append(entry)
    package = entry["__name__"]
    if not Path(entry["__path__"][0]).is_dir():
        entry["__path__"][:] = sys.path[:1]  # where PythonFMU has just inserted the folder
        for module in [
            module
            for module in sys.modules
            if module.startswith(f"{package}.") and module != __name__
        ]:
            del sys.modules[module]
    slave_class = protected_class(getattr(importlib.import_module(f"{package}.{source}"), name))
    entry[name] = slave_class  # PythonFMU reads it from there
    return slave_class


def _get_state(slave: Fmi2Slave) -> dict[str, Restore]:
    return {"restore": snapshot(slave, PYTHONFMU_ATTRIBUTES)}


def _set_state(_slave: Fmi2Slave, state: dict[str, Restore]) -> None:
    state["restore"]()


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
    folder = sys.modules[__package__].__path__[0]
    frames = [
        (Path(frame.filename), frame.lineno) for frame in traceback.extract_tb(error.__traceback__)
    ]
    others = ("pythonfmu", Path(__file__).name)
    own = [
        (file.name, line)
        for file, line in frames
        if file.is_relative_to(folder) and not {*file.parts[-2:]} & {*others}
    ]
    where = f" ({own[-1][0]}:{own[-1][1]})" if own else ""
    return f"{type(error).__name__}: {error}{where}"
