"""Floating-point mode of this thread, which foreign code may change."""

import ctypes
import platform
import struct
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from typing import Any

from ..core import component_log

#: 1, a number too small to change 1 when rounding to nearest, and the smallest subnormal number,
#: which flush to zero makes 0 (a literal could already be flushed when it is parsed)
PROBE_VALUES = 1.0, 2.0**-54, float(struct.unpack("=d", (1).to_bytes(8, sys.byteorder))[0])

_ENVIRONMENT_SIZE = 512  # more than any platform's fenv_t
#: offset in fenv_t of Linux on x86-64, and initial value of a process
_MXCSR_OFFSET, _MXCSR_DEFAULT = 28, 0x1F80


def is_changed() -> bool:
    """Return whether numbers are not rounded to nearest, or subnormal ones are flushed to zero."""
    one, tiny, smallest = PROBE_VALUES
    return one + tiny != one - tiny or not smallest + smallest


def is_default() -> bool:
    """Return whether the mode is that of a new process."""
    return not is_changed() and not enabled_traps()


#: returns the enabled floating-point traps as bits; always 0 if the C library has no fegetexcept
enabled_traps: Callable[[], int] = int
with suppress(AttributeError, OSError, TypeError):
    enabled_traps = ctypes.PyDLL(None).fegetexcept


class FloatEnvironment:
    """Floating-point mode at the time of construction."""

    def __init__(self) -> None:
        self._state = ctypes.create_string_buffer(_ENVIRONMENT_SIZE)
        self._traps = enabled_traps()
        ctypes.PyDLL(None).fegetenv(self._state)

    def restore(self) -> bool:
        """Restore the mode if it was changed; return whether it was changed."""
        if not is_changed() and enabled_traps() == self._traps:
            return False
        self.reinstate()
        return True

    def reinstate(self) -> None:
        """Set the mode without checking the present mode."""
        ctypes.PyDLL(None).fesetenv(self._state)


@contextmanager
def default_float_mode() -> Iterator[None]:
    """Use the mode of a new process inside the block, then restore the mode of the caller.

    Some libraries change the mode permanently when they are imported; results must not depend on
    that.
    """
    if is_default():
        yield
        return
    outer = FloatEnvironment()
    set_default()
    try:
        yield
    finally:
        outer.reinstate()


def set_default() -> None:
    """Set the mode of a new process in this thread."""
    ctypes.PyDLL(None).fesetenv(_default_environment())


class FloatModeGuard:
    """Restorer of the default mode after calls of components.

    It warns of the first change by each component.
    """

    def __init__(self) -> None:
        self._reported: set[str] = set()

    def restore(self, component: str, function: str, time: float, preposition: str = "at") -> None:
        """Set the default mode, and warn unless the component has been reported before.

        Args:
            component: Name of the component that changed the mode.
            function: Function or action that did so, for the message.
            time: Time of the call (s).
            preposition: "at", or "before" if the change is noticed later than in the call.
        """
        set_default()
        if component not in self._reported:
            self._reported.add(component)
            change = (
                f"{function} changed the floating-point mode (rounding, flush to zero or traps)"
            )
            text = (
                f"{change} {preposition} t = {time:.12g} s; it is restored after every such call, "
                "which is reported once"
            )
            component_log.log_message(component, component_log.WARNING, text)


@cache
def _default_environment() -> Any:
    """Return FE_DFL_ENV of <fenv.h>.

    On x86-64 flush to zero is off in it, which FE_DFL_ENV does not reset there.
    """
    if sys.platform == "darwin":
        return ctypes.c_void_p(
            ctypes.addressof(ctypes.c_char.in_dll(ctypes.PyDLL(None), "_FE_DFL_ENV"))
        )
    environment = ctypes.c_void_p(-1)
    if platform.machine() != "x86_64":
        return environment
    ctypes.PyDLL(None).fesetenv(environment)
    state = ctypes.create_string_buffer(_ENVIRONMENT_SIZE)
    ctypes.PyDLL(None).fegetenv(state)
    struct.pack_into("I", state, _MXCSR_OFFSET, _MXCSR_DEFAULT)
    return state
