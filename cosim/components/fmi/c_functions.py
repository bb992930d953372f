"""C functions of an FMU as ctypes calls them fastest.

All they return is an FMI status. The function types that libraries of ctypes make say so ("int"); without a type ctypes takes
an int for granted, which saves a tenth of every call.
"""

from __future__ import annotations

import ctypes
from _ctypes import FUNCFLAG_CDECL, FUNCFLAG_PYTHONAPI, CFuncPtr
from functools import cache
from typing import Any

#: arguments made beforehand, which ctypes passes on as they are: half the price of a call goes into converting others
as_pointer = ctypes.c_void_p.from_param
as_size, as_double = cache(ctypes.c_size_t.from_param), cache(ctypes.c_double.from_param)


class GilHoldingFunction(CFuncPtr):
    """Called while the interpreter lock is held."""

    _flags_ = FUNCFLAG_CDECL | FUNCFLAG_PYTHONAPI


class GilReleasingFunction(CFuncPtr):
    """Called without the interpreter lock: it may take long, and other threads may log meanwhile."""

    _flags_ = FUNCFLAG_CDECL


class FunctionTable(dict[str, CFuncPtr]):
    """The functions of one loaded library by their names, each made once for all instances."""

    def __init__(self, library: ctypes.CDLL):
        super().__init__()
        self._library = library

    def __missing__(self, name: str) -> CFuncPtr:
        kind = GilReleasingFunction if name.endswith("DoStep") else GilHoldingFunction
        self[name] = kind((name, self._library))
        return self[name]


def function_address(function: Any) -> int:
    """Where a C function lies."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0
