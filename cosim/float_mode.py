"""The floating-point mode of this thread, which foreign code may change and everybody computes in."""

from __future__ import annotations

import ctypes
from collections.abc import Callable

REASON = "changed the floating-point mode (rounding, flush to zero or traps) and did not restore it"

_ENVIRONMENT_SIZE = 512  # more than any platform's fenv_t


def changed() -> bool:
    """Whether it rounds in another way than usual or flushes small numbers to zero."""
    # equal in the default rounding mode only, and the least denormal is no zero only if it is not flushed
    one, little, least = 1.0, 2.0**-54, 5e-324
    return one + little != one - little or not least + least


def _find_traps() -> Callable[[], int]:
    try:
        found: Callable[[], int] = ctypes.PyDLL(None).fegetexcept
    except (AttributeError, OSError, TypeError):
        return lambda: 0
    return found


#: which floating-point exceptions end the process, as the C library tells; 0 where it does not
traps = _find_traps()


class Environment:
    """The mode as it is now, so that it can be restored."""

    def __init__(self) -> None:
        self._state = ctypes.create_string_buffer(_ENVIRONMENT_SIZE)
        self._traps = traps()
        ctypes.PyDLL(None).fegetenv(self._state)

    def restore(self) -> bool:
        """Bring it back; returns whether it had been changed."""
        if not changed() and traps() == self._traps:
            return False
        ctypes.PyDLL(None).fesetenv(self._state)
        return True
