"""Libraries of FMUs: loading with FMPy, and fast ctypes calls of their functions.

FMI functions return a status. ctypes assumes an int result when no `restype` is set, which takes a
tenth less time per call than an explicit `restype`.
"""

import ctypes
import inspect
from _ctypes import FUNCFLAG_CDECL, FUNCFLAG_PYTHONAPI, CFuncPtr
from collections.abc import Callable
from functools import cache
from importlib import import_module
from itertools import count
from pathlib import Path
from types import UnionType
from typing import Any, get_args

from ...core.errors import InputError
from .description import FmuDescription
from .file import FmuFile
from .preflight.c_functions import function_prefix
from .preflight.platforms import current_platform

try:
    import cosim.components.fmi._logger as _logger
except ImportError:  # installed without a C compiler: the text arrives unformatted
    _logger = None  # type: ignore[assignment]  # a module cannot be declared optional

#: argument objects that ctypes passes on unchanged; converting arguments in each call would double
#: its time
as_pointer = ctypes.c_void_p.from_param
as_size, as_double = cache(ctypes.c_size_t.from_param), cache(ctypes.c_double.from_param)


class GilHoldingFunction(CFuncPtr):
    """C function that is called with the global interpreter lock held."""

    _flags_ = FUNCFLAG_CDECL | FUNCFLAG_PYTHONAPI


class GilReleasingFunction(CFuncPtr):
    """C function that is called without the global interpreter lock.

    It may take long, or log from other threads.
    """

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


def load_library(file: FmuFile, folder: Path) -> Any:
    """Load the library of an extracted FMU.

    Args:
        file: The FMU.
        folder: Folder of the extracted FMU.

    Returns:
        FMPy's slave object. Its attribute `functions` is the `FunctionTable` of the library.

    Raises:
        InputError: The library cannot be loaded.
    """
    try:
        slave = _create_slave(file.description, folder)
    except Exception as error:
        reason = str(error).replace(f"{folder}/", "")
        raise InputError(f'the binary of "{file.path}" cannot be loaded: {reason}') from None
    slave.functions = FunctionTable(slave.dll)
    return slave


def _create_slave(description: FmuDescription, folder: Path) -> Any:
    """Create FMPy's slave object without its constructor.

    The constructor changes the working directory of all threads during the load.
    """
    major, machine = description.major, current_platform()
    interface = "Model" if description.interface == "model-exchange" else "Slave"
    slave_class = getattr(import_module(f"fmpy.fmi{major}"), f"FMU{major}{interface}")
    library = (
        folder
        / "binaries"
        / machine.binary_folder(major)
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
        slave_class, slave.dll, function_prefix(major, description.model_identifier)
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
        function.restype = ctypes.c_int
        # FMPy's annotations declare texts for statuses of FMI 1.0
        for begin, kind in _RESULT_TYPES.items():
            if name.startswith(begin, len("fmi1")):
                function.restype = kind
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


# The logger callback of FMI 1.0 and FMI 2.0 gets a printf format followed by its arguments. ctypes
# cannot read the arguments of a variadic function. Therefore a C function formats the messages of
# all instances and calls one function of this module, which dispatches them.

#: receives the status and the text of a message
_MessageHandler = Callable[[int, bytes | None], None]

_environments = count(1)
#: instance names and handlers by componentEnvironment, in the order of their registration
_handlers: dict[int, tuple[bytes, _MessageHandler]] = {}


def register_logger(callbacks: Any, instance_name: str, handler: _MessageHandler) -> int:
    """Set logger and memory management in the callback functions of an instance.

    Args:
        callbacks: FMPy's fmi1CallbackFunctions or fmi2CallbackFunctions.
        instance_name: Name of the instance, by which FMI 1.0 identifies it.
        handler: Function that receives the messages of the instance.

    Returns:
        The key of the registration, for `unregister_logger`. It is the componentEnvironment of
        FMI 2.0.
    """
    from fmpy import calloc, free

    key = next(_environments)
    _handlers[key] = instance_name.encode(), handler
    logger = ctypes.c_void_p(_logger.LOGGER) if _logger else _UNFORMATTED
    callbacks.logger = ctypes.cast(logger, type(callbacks.logger))
    callbacks.allocateMemory = type(callbacks.allocateMemory)(calloc)
    callbacks.freeMemory = type(callbacks.freeMemory)(free)
    if hasattr(callbacks, "componentEnvironment"):
        callbacks.componentEnvironment = key
    return key


def unregister_logger(key: int) -> None:
    """Forget a registration; later messages of the instance go to another one, or are dropped."""
    _handlers.pop(key, None)


def _dispatch(environment: int | None, name: bytes | None, status: int, text: bytes | None) -> None:
    """Pass a message to the instance of the environment, else of the name, else to the newest."""
    if environment in _handlers:
        _handlers[environment][1](status, text)
        return
    newest_first = list(reversed(_handlers.values()))
    named = [handler for known, handler in newest_first if known == name]
    for handler in (*named, *(handler for _, handler in newest_first)):
        handler(status, text)
        return


_receiver = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p)(
    _dispatch
)
_UNFORMATTED = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)(lambda environment, name, status, _, text: _dispatch(environment, name, status, text))
if _logger:
    ctypes.c_void_p.from_address(_logger.RECEIVER).value = ctypes.cast(
        _receiver, ctypes.c_void_p
    ).value
