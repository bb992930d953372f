"""Loading of an FMU's library with FMPy."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

from ...core.errors import InputError
from .c_functions import FunctionTable
from .file import FmuFile


def load_library(file: FmuFile, folder: Path, create_slave: Callable[..., Any]) -> Any:
    """Load the library of an extracted FMU.

    Args:
        file: The FMU.
        folder: Folder of the extracted FMU.
        create_slave: Creates FMPy's slave object, given `guid`, `modelIdentifier` and `unzipDirectory`.

    Returns:
        FMPy's slave object. Its attribute `functions` is the `FunctionTable` of the library.

    Raises:
        InputError: The library cannot be loaded.
    """
    description = file.description
    try:
        slave = create_slave(
            guid=description.instantiation_token, modelIdentifier=description.model_identifier, unzipDirectory=str(folder)
        )
    except Exception as error:
        reason = str(error).replace(f"{folder}/", "")
        raise InputError(f'the binary of "{file.path}" cannot be loaded: {reason}') from None
    for function in slave._functions.values():
        if function.restype is ctypes.c_int:
            function.errcheck = _reject_negative_status
    slave.functions = FunctionTable(slave.dll)
    return slave


def _reject_negative_status(status: int, function: Any, _: Any) -> int:
    """Raise FMPy's exception for a negative status, which FMPy itself accepts as success."""
    from fmpy.fmi1 import FMICallException

    if status < 0:
        raise FMICallException(function.__name__, status)
    return status
