"""Attributes of the process that foreign code may change: read and restore their values."""

from __future__ import annotations

import ctypes
import errno
import locale
import os
import resource
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from .float_mode import FloatEnvironment

_SIGNALS = (
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGSEGV,
    signal.SIGFPE,
    signal.SIGABRT,
    signal.SIGPIPE,
    signal.SIGCHLD,
)
_TIMERS = (signal.ITIMER_REAL, signal.ITIMER_VIRTUAL, signal.ITIMER_PROF)
_LIMITS = (
    resource.RLIMIT_AS,
    resource.RLIMIT_CPU,
    resource.RLIMIT_DATA,
    resource.RLIMIT_FSIZE,
    resource.RLIMIT_NOFILE,
)
#: descriptors that foreign code cannot use up (see `reserve_descriptors`)
_RESERVED_DESCRIPTORS = 32
_SIGACTION_SIZE = 512  # more than any platform's struct sigaction, which begins with the handler
_POINTER_SIZE = ctypes.sizeof(ctypes.c_void_p)


class ProcessState:
    """Values of all attributes in `_ATTRIBUTES` at the time of construction."""

    def __init__(self) -> None:
        self._values = [attribute.read() for attribute in _ATTRIBUTES]

    def restore(self) -> list[str]:
        """Restore all attributes; return a description of each one that had changed."""
        details = (
            (attribute.name, attribute.restore(value))
            for attribute, value in zip(_ATTRIBUTES, self._values, strict=True)
        )
        return [f"{name}{detail}" for name, detail in details if detail is not None]


@cache
def _c_library() -> Any:
    library = ctypes.CDLL(None)
    library.setlocale.restype = ctypes.c_char_p
    return library


def _working_directory() -> str:
    with suppress(OSError):
        return str(Path.cwd())
    return ""


def _set_working_directory(path: str) -> None:
    with suppress(OSError):  # the folder was removed meanwhile
        os.chdir(path)


def _umask() -> int:
    mask = os.umask(0o077)  # safe for a file that another thread creates now
    os.umask(mask)
    return mask


def _locale() -> bytes:
    return bytes(_c_library().setlocale(locale.LC_ALL, None) or b"C")


def _set_locale(name: bytes) -> None:
    _c_library().setlocale(locale.LC_ALL, name)


def _c_environment() -> dict[bytes, bytes]:
    """Return the environment of the C library, which foreign code changes without changing `os.environ`."""
    if sys.platform != "linux":
        return {}
    entries = ctypes.POINTER(ctypes.c_char_p).in_dll(_c_library(), "environ")
    variables, i = {}, 0
    while entries and (entry := entries[i]) is not None:
        name, _, value = entry.partition(b"=")
        variables[name] = value
        i += 1
    return variables


def _set_c_environment(variables: dict[bytes, bytes]) -> None:
    current = _c_environment()
    for name in (
        name for name in {*current, *variables} if current.get(name) != variables.get(name)
    ):
        with suppress(OSError, ValueError):  # a name that is not permitted
            if (value := variables.get(name)) is None:
                os.environb.pop(name, None)
                _c_library().unsetenv(name)  # a variable that `os.environ` does not know
            else:
                os.environb[name] = value


def signal_mask() -> set[int]:
    """Return the numbers of the signals that this thread blocks."""
    return {*signal.pthread_sigmask(signal.SIG_BLOCK, ())}


def set_signal_mask(mask: set[int]) -> None:
    """Set the numbers of the signals that this thread blocks."""
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _restore_float_mode(environment: FloatEnvironment) -> str | None:
    return "" if environment.restore() else None


def _signal_actions() -> dict[int, bytes]:
    """Return the C `struct sigaction` of each signal in `_SIGNALS`."""
    actions: dict[int, bytes] = {}
    for number in _SIGNALS:
        action = ctypes.create_string_buffer(_SIGACTION_SIZE)
        _c_library().sigaction(int(number), None, action)
        actions[number] = action.raw
    return actions


def _restore_signal_actions(saved: dict[int, bytes]) -> str | None:
    """Restore the actions whose handlers differ; return the names of their signals."""
    current = _signal_actions()
    changed = [
        number
        for number in saved
        if current[number][:_POINTER_SIZE] != saved[number][:_POINTER_SIZE]
    ]
    for number in changed:
        _c_library().sigaction(int(number), saved[number], None)
    return f" {', '.join(signal.Signals(number).name for number in changed)}" if changed else None


def _running_timers() -> set[int]:
    return {timer for timer in _TIMERS if any(signal.getitimer(timer))}


def _stop_new_timers(saved: set[int]) -> str | None:
    new = _running_timers() - saved
    for timer in new:
        signal.setitimer(timer, 0)
    return "" if new else None


def _resource_limits() -> dict[int, tuple[int, int]]:
    return {kind: resource.getrlimit(kind) for kind in _LIMITS}


def _restore_resource_limits(saved: dict[int, tuple[int, int]]) -> str | None:
    """Restore limits if permitted; a lowered hard limit cannot be raised again."""
    current = _resource_limits()
    if current == saved:
        return None
    for kind, limit in saved.items():
        if current[kind] != limit:
            with suppress(ValueError, OSError):
                resource.setrlimit(kind, limit)
    return "" if _resource_limits() == saved else " (what was lowered for good stays so)"


def reserve_descriptors() -> None:
    """Lower the soft limit of open files, so that there are descriptors for results when foreign code has used up all others."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft > 2 * _RESERVED_DESCRIPTORS:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft - _RESERVED_DESCRIPTORS, hard))


def _has_free_descriptor() -> bool:
    try:
        os.close(os.dup(2))
    except OSError as error:
        return error.errno != errno.EMFILE
    return True


def _release_descriptors(had_free: bool) -> str | None:
    """Release the reserved descriptors if no others are free."""
    if not had_free or _has_free_descriptor():
        return None
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft + _RESERVED_DESCRIPTORS, hard))
    return " (none was left)"


class _Attribute(NamedTuple):
    """One attribute of the process.

    `restore` takes the value that `read` returned earlier. It returns None if nothing had changed,
    else details that follow the name in the warning.
    """

    name: str
    read: Callable[[], Any]
    restore: Callable[[Any], str | None]


def _compared(name: str, read: Callable[[], Any], write: Callable[[Any], object]) -> _Attribute:
    """Return an attribute that is compared by its value and restored by `write`."""

    def restore(value: Any) -> str | None:
        if read() == value:
            return None
        write(value)
        return ""

    return _Attribute(name, read, restore)


_ATTRIBUTES = (
    _Attribute("the floating-point mode", FloatEnvironment, _restore_float_mode),
    _compared("the working directory", _working_directory, _set_working_directory),
    _compared("the file mode mask", _umask, os.umask),
    _compared("the locale", _locale, _set_locale),
    _compared("the environment", _c_environment, _set_c_environment),
    _Attribute("what is done upon", _signal_actions, _restore_signal_actions),
    _compared("which signals are blocked", signal_mask, set_signal_mask),
    _Attribute("the timers", _running_timers, _stop_new_timers),
    _Attribute("the limits", _resource_limits, _restore_resource_limits),
    _Attribute("the number of free descriptors", _has_free_descriptor, _release_descriptors),
)
