"""Fast ctypes calls of FMI functions.

FMI functions return a status. ctypes assumes an int result when no `restype` is set, which takes a
tenth less time per call than an explicit `restype`.
"""

from __future__ import annotations

import ctypes
from _ctypes import FUNCFLAG_CDECL, FUNCFLAG_PYTHONAPI, CFuncPtr
from functools import cache

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
