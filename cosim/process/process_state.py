"""What foreign code may change in the process it is loaded into, and how to change it back."""

from __future__ import annotations

import ctypes
import locale
import os
import signal
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ..core import component_log
from . import float_mode
from .journal import Phase, current_journal

if sys.platform != "win32":
    import resource

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGSEGV, signal.SIGFPE, signal.SIGABRT, signal.SIGPIPE, signal.SIGCHLD)
_SIGACTION_SIZE = 512  # more than any platform's struct sigaction, which begins with the handler
_POINTER_SIZE = ctypes.sizeof(ctypes.c_void_p)


@dataclass(frozen=True)
class ProcessState:
    """Working directory, file mode mask, locale of the C library, environment, signals, floating-point mode and limits."""

    working_directory: str
    umask: int
    locale: bytes
    environment: dict[bytes, bytes]
    signal_actions: dict[int, bytes]
    float_environment: float_mode.FloatEnvironment
    signal_mask: set[int]
    timers: dict[int, bool]
    resource_limits: dict[int, tuple[int, int]]

    @classmethod
    def capture(cls) -> ProcessState:
        mask = os.umask(0)
        os.umask(mask)
        handlers: dict[int, bytes] = {number: _signal_action(number) for number in _SIGNALS}
        floats, blocked = float_mode.FloatEnvironment(), _signal_mask()
        return cls(
            str(Path.cwd()), mask, _locale(), _c_environment(), handlers, floats, blocked, _running_timers(), _resource_limits()
        )

    def restore(self) -> list[str]:
        """Bring everything back to this state; says what had been changed."""
        return list(self._restore_each())

    def _restore_each(self) -> Iterator[str]:
        if self.float_environment.restore():
            yield "the floating-point mode"
        if _working_directory() != self.working_directory:
            os.chdir(self.working_directory)
            yield "the working directory"
        if os.umask(self.umask) != self.umask:
            yield "the file mode mask"
        if _locale() != self.locale:
            _c_library().setlocale(locale.LC_ALL, self.locale)
            yield "the locale"
        if (now := _c_environment()) != self.environment:
            for name in {*now, *self.environment}:
                value = self.environment.get(name)
                _c_library().unsetenv(name) if value is None else _c_library().setenv(name, value, 1)
            yield "the environment"
        changed = [n for n in _SIGNALS if _signal_action(n)[:_POINTER_SIZE] != self.signal_actions[n][:_POINTER_SIZE]]
        for number in changed:
            _c_library().sigaction(int(number), self.signal_actions[number], None)
        if changed:
            yield f"what is done upon {', '.join(signal.Signals(number).name for number in changed)}"
        if _signal_mask() != self.signal_mask:
            signal.pthread_sigmask(signal.SIG_SETMASK, self.signal_mask)
            yield "which signals are blocked"
        if running := [timer for timer, runs in _running_timers().items() if runs and not self.timers[timer]]:
            for timer in running:
                signal.setitimer(timer, 0)
            yield "the timers"
        if (limits := _resource_limits()) != self.resource_limits:
            for kind, limit in self.resource_limits.items():
                if limits[kind] != limit:
                    _restore_limit(kind, limit)
            yield (
                "the limits" if _resource_limits() == self.resource_limits else "the limits (what was lowered for good stays so)"
            )


@contextmanager
def restoring_process_state(component: str) -> Iterator[None]:
    """What components change in the process while the block lasts is changed back, and `who` is named.

    A supervised process whose own output was closed ends here: only its supervisor can still say by whom, and save the rows.
    """
    state, voices = ProcessState.capture(), _output_files()
    try:
        yield
    finally:
        journal = current_journal()
        if journal and voices != _output_files():
            journal.record_call(component, "a call that closed the files of the process")
            journal.enter_phase(Phase.CALLING)
            os._exit(70)
        for what in state.restore():
            component_log.log_message(component, component_log.WARNING, f"changed {what} of the process; it was changed back")


def _output_files() -> list[tuple[int, int]]:
    """What the streams of Python lead to, if they can be written."""
    found = []
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            place = os.fstat(stream.fileno())
            found.append((place.st_dev, place.st_ino))
    return found


@cache
def _c_library() -> Any:
    library = ctypes.CDLL(None)
    library.setlocale.restype = ctypes.c_char_p
    return library


def _working_directory() -> str:
    with suppress(OSError):
        return str(Path.cwd())
    return ""


def _locale() -> bytes:
    return bytes(_c_library().setlocale(locale.LC_ALL, None) or b"C")


def _c_environment() -> dict[bytes, bytes]:
    """The C library's environment; Python's own copy is not changed by foreign code."""
    if sys.platform != "linux":
        return {}
    entries = ctypes.POINTER(ctypes.c_char_p).in_dll(_c_library(), "environ")
    found, i = {}, 0
    while entries and entries[i] is not None:
        name, _, value = entries[i].partition(b"=")
        found[name] = value
        i += 1
    return found


def _signal_action(number: int) -> bytes:
    if sys.platform == "win32":
        return b""
    action = ctypes.create_string_buffer(_SIGACTION_SIZE)
    _c_library().sigaction(int(number), None, action)
    return action.raw


def _signal_mask() -> set[int]:
    return set() if sys.platform == "win32" else {*signal.pthread_sigmask(signal.SIG_BLOCK, ())}


def _running_timers() -> dict[int, bool]:
    """Whether the timers that send signals are running."""
    if sys.platform == "win32":
        return {}
    return {timer: any(signal.getitimer(timer)) for timer in (signal.ITIMER_REAL, signal.ITIMER_VIRTUAL, signal.ITIMER_PROF)}


def _resource_limits() -> dict[int, tuple[int, int]]:
    if sys.platform == "win32":
        return {}
    kinds = (resource.RLIMIT_AS, resource.RLIMIT_CPU, resource.RLIMIT_DATA, resource.RLIMIT_FSIZE, resource.RLIMIT_NOFILE)
    return {kind: resource.getrlimit(kind) for kind in kinds}


def _restore_limit(kind: int, limit: tuple[int, int]) -> None:
    """As far as that is allowed: what was given away for good stays away."""
    if sys.platform == "win32":
        return
    with suppress(ValueError, OSError):
        resource.setrlimit(kind, limit)
