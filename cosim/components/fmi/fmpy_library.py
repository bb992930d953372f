"""Loading of an FMU's library with FMPy."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

from ...core.errors import InputError
from .c_functions import FunctionTable
from .description import FmuDescription
from .file import FmuFile
from .preflight.fmu_platform import current_platform

#: argument names, argument types and result type of the functions of FMPy's classes, which it takes milliseconds to find out
_prototypes: dict[type, dict[str, tuple[Any, Any, Any]]] = {}


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
    for function in slave._functions.values():
        if function.restype is ctypes.c_int:
            function.errcheck = _reject_negative_status
    slave.functions = FunctionTable(slave.dll)
    return slave


def _create_slave(slave_class: type, description: FmuDescription, folder: Path) -> Any:
    """Create FMPy's slave object without its constructor, which changes the working directory of all threads during the load."""
    machine = current_platform()
    library = folder / "binaries" / machine.binary_folder(description.major) / f"{description.model_identifier}{machine.suffix}"
    slave: Any = object.__new__(slave_class)
    vars(slave).update(
        guid=description.instantiation_token,
        unzipDirectory=str(folder),
        dll=ctypes.cdll.LoadLibrary(str(library)),
        requireFunctions=True,
        fmiCallLogger=None,
        callbacks=None,
        component=None,
        _functions={},
    )
    if (prototypes := _prototypes.get(slave_class)) is None:
        slave._loadFunctions()
        _prototypes[slave_class] = {name: (f.argnames, f.argtypes, f.restype) for name, f in slave._functions.items()}
    else:
        for name, prototype in prototypes.items():
            function = slave._functions[name] = getattr(slave.dll, name)
            function.argnames, function.argtypes, function.restype = prototype
    return slave


def _reject_negative_status(status: int, function: Any, _: Any) -> int:
    """Raise FMPy's exception for a negative status, which FMPy itself accepts as success."""
    from fmpy.fmi1 import FMICallException

    if status < 0:
        raise FMICallException(function.__name__, status)
    return status
