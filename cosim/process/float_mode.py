"""The floating-point mode of this thread, which foreign code may change and everybody computes in."""

from __future__ import annotations

import ctypes
import platform
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

CHANGE_REASON = "changed the floating-point mode (rounding, flush to zero or traps) and did not restore it"

#: 1 and a number that makes no difference to it when rounding to nearest; the least denormal, which is no zero only if it is not
#: flushed (as a literal it could be flushed already while it is read)
PROBE_VALUES = 1.0, 2.0**-54, float(struct.unpack("=d", (1).to_bytes(8, sys.byteorder))[0])

_ENVIRONMENT_SIZE = 512  # more than any platform's fenv_t
_MXCSR_OFFSET, _MXCSR_DEFAULT = 28, 0x1F80  # place in Linux's fenv_t of x86-64, and what a process starts with


def is_changed() -> bool:
    """Whether it rounds in another way than usual or flushes small numbers to zero."""
    one, little, least = PROBE_VALUES
    return one + little != one - little or not least + least


def _find_fegetexcept() -> Callable[[], int]:
    try:
        found: Callable[[], int] = ctypes.PyDLL(None).fegetexcept
    except (AttributeError, OSError, TypeError):
        return lambda: 0
    return found


#: which floating-point exceptions end the process, as the C library tells; 0 where it does not
enabled_traps = _find_fegetexcept()


class FloatEnvironment:
    """The mode as it is now, so that it can be restored."""

    def __init__(self) -> None:
        self._state = ctypes.create_string_buffer(_ENVIRONMENT_SIZE)
        self._traps = enabled_traps()
        ctypes.PyDLL(None).fegetenv(self._state)

    def restore(self) -> bool:
        """Bring it back; returns whether it had been changed."""
        if not is_changed() and enabled_traps() == self._traps:
            return False
        self.reinstate()
        return True

    def reinstate(self) -> None:
        ctypes.PyDLL(None).fesetenv(self._state)


@contextmanager
def default_float_mode() -> Iterator[None]:
    """While the block lasts, the mode that a process starts with, whatever the caller's is.

    Some libraries change it for good as soon as they are imported; results must not depend on that.
    """
    if not is_changed() and not enabled_traps():
        yield
        return
    callers = FloatEnvironment()
    ctypes.PyDLL(None).fesetenv(_default_environment())
    try:
        yield
    finally:
        callers.reinstate()


def _default_environment() -> Any:
    """FE_DFL_ENV of <fenv.h>; on x86 that alone would leave small numbers flushed to zero."""
    if sys.platform == "darwin":
        return ctypes.c_void_p(ctypes.addressof(ctypes.c_char.in_dll(ctypes.PyDLL(None), "_FE_DFL_ENV")))
    environment = ctypes.c_void_p(-1)
    if platform.machine() != "x86_64":
        return environment
    ctypes.PyDLL(None).fesetenv(environment)
    state = ctypes.create_string_buffer(_ENVIRONMENT_SIZE)
    ctypes.PyDLL(None).fegetenv(state)
    struct.pack_into("I", state, _MXCSR_OFFSET, _MXCSR_DEFAULT)
    return state
