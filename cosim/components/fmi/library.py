"""Libraries of FMUs: loading with FMPy, and fast ctypes calls of their functions.

FMI functions return a status. ctypes assumes an int result when no `restype` is set, which takes a
tenth less time per call than an explicit `restype`.
"""

from __future__ import annotations

import ctypes
import inspect
from _ctypes import FUNCFLAG_CDECL, FUNCFLAG_PYTHONAPI, CFuncPtr
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any, get_args

from ...core.errors import InputError
from .description import FmuDescription
from .file import FmuFile
from .preflight.functions import function_prefix
from .preflight.platforms import current_platform

#: argument objects that ctypes passes on unchanged; converting arguments in each call would double
#: its time
as_pointer = ctypes.c_void_p.from_param
as_size, as_double = cache(ctypes.c_size_t.from_param), cache(ctypes.c_double.from_param)


class GilHoldingFunction(CFuncPtr):
    """C function that is called with the global interpreter lock held."""

    _flags_ = FUNCFLAG_CDECL | FUNCFLAG_PYTHONAPI


class GilReleasingFunction(CFuncPtr):
    """C function that is called without the global interpreter lock, because it may take long or log from other threads."""

    _flags_ = FUNCFLAG_CDECL


class FunctionTable(dict[str, CFuncPtr]):
    """Functions of one loaded library by name, created on first use and shared by all instances."""

    def __init__(self, library: ctypes.CDLL):
        super().__init__()
        self._library = library

    def __contains__(self, name: object) -> bool:
        """Return whether the library exports a function."""
        return hasattr(self._library, str(name))

    def __missing__(self, name: str) -> CFuncPtr:
        function_class = GilReleasingFunction if name.endswith("DoStep") else GilHoldingFunction
        self[name] = function_class((name, self._library))
        return self[name]


def function_address(function: CFuncPtr) -> int:
    """Return the address of a C function in memory."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0


class MissingFunctionError(Exception):
    """Name of a function that the library does not export."""


def load_library(file: FmuFile, folder: Path, slave_class: type) -> Any:
    """Load the library of an extracted FMU.

    Args:
        file: The FMU.
        folder: Folder of the extracted FMU.
        slave_class: FMPy's class of a slave.

    Returns:
        FMPy's slave object. Its attribute `functions` is the `FunctionTable` of the library.

    Raises:
        InputError: The library cannot be loaded.
    """
    try:
        slave = _create_slave(slave_class, file.description, folder)
    except Exception as error:
        reason = str(error).replace(f"{folder}/", "")
        raise InputError(f'the binary of "{file.path}" cannot be loaded: {reason}') from None
    slave.functions = FunctionTable(slave.dll)
    return slave


def _create_slave(slave_class: type, description: FmuDescription, folder: Path) -> Any:
    """Create FMPy's slave object without its constructor, which changes the working directory of all threads during the load."""
    machine = current_platform()
    library = (
        folder
        / "binaries"
        / machine.binary_folder(description.major)
        / f"{description.model_identifier}{machine.suffix}"
    )
    slave: Any = object.__new__(slave_class)
    vars(slave).update(
        guid=description.instantiation_token,
        unzipDirectory=str(folder),
        dll=ctypes.cdll.LoadLibrary(str(library)),
        modelIdentifier=description.model_identifier,
        fmiCallLogger=None,
        callbacks=None,
        component=None,
    )
    slave._functions = _SlaveFunctions(
        slave_class, slave.dll, function_prefix(description.major, description.model_identifier)
    )
    return slave


#: beginnings of names, without the prefix, and types of the results in C; the other functions
#: return a status
_RESULT_TYPES = {
    "Instantiate": ctypes.c_void_p,
    "Free": None,
    "FreeFMU": ctypes.c_int,
    "GetVersion": ctypes.c_char_p,
    "GetTypesPlatform": ctypes.c_char_p,
    "GetModelTypesPlatform": ctypes.c_char_p,
}


def _result_type(name: str) -> Any:
    """Return the type of a function's result.

    FMPy's annotations declare texts for statuses of FMI 1.0.
    """
    return next(
        (kind for begin, kind in reversed(_RESULT_TYPES.items()) if name.startswith(begin)),
        ctypes.c_int,
    )


class _SlaveFunctions(dict[str, Any]):
    """C functions as FMPy's slave object calls them, by name; each is created on first use.

    FMPy itself creates all functions of the standard at once, which takes milliseconds and fails if
    one of them is missing.
    """

    def __init__(self, slave_class: type, library: ctypes.CDLL, prefix: str):
        super().__init__()
        self._slave_class, self._library, self._prefix = slave_class, library, prefix

    def __missing__(self, name: str) -> Any:
        try:
            function: Any = self._library[self._prefix + name[len("fmi1") :]]
        except AttributeError:
            raise MissingFunctionError(name) from None
        function.argtypes = _argument_types(self._slave_class, name)
        function.restype = _result_type(name[len("fmi1") :])
        if function.restype is ctypes.c_int:
            function.errcheck = _reject_negative_status
        self[name] = function
        return function


@cache
def _argument_types(slave_class: type, name: str) -> list[type]:
    """Return the types of a function's arguments in C."""
    signature = inspect.signature(getattr(slave_class, name))
    types = [parameter.annotation for parameter in list(signature.parameters.values())[1:]]
    return [get_args(kind)[0] if isinstance(kind, UnionType) else kind for kind in types]


def _reject_negative_status(status: int, function: Any, _: Any) -> int:
    """Raise FMPy's exception for a negative status, which FMPy itself accepts as success."""
    from fmpy.fmi1 import FMICallException

    if status < 0:
        raise FMICallException(function.__name__, status)
    return status
