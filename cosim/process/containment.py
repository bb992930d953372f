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
from .journal import Phase, current

if sys.platform != "win32":
    import resource

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGSEGV, signal.SIGFPE, signal.SIGABRT, signal.SIGPIPE, signal.SIGCHLD)
_SIGACTION_SIZE = 512  # more than any platform's struct sigaction, which begins with the handler
_POINTER = ctypes.sizeof(ctypes.c_void_p)


@dataclass(frozen=True)
class ProcessState:
    """Working directory, file mode mask, locale of the C library, environment, signals, floating-point mode and limits."""

    directory: str
    mask: int
    locale: bytes
    environment: dict[bytes, bytes]
    handlers: dict[int, bytes]
    floats: float_mode.Environment
    blocked: set[int]
    timers: dict[int, bool]
    limits: dict[int, tuple[int, int]]

    @classmethod
    def now(cls) -> ProcessState:
        mask = os.umask(0)
        os.umask(mask)
        handlers: dict[int, bytes] = {number: _handler(number) for number in _SIGNALS}
        floats, blocked = float_mode.Environment(), _blocked()
        return cls(str(Path.cwd()), mask, _locale(), _environment(), handlers, floats, blocked, _timers(), _limits())

    def restore(self) -> list[str]:
        """Bring everything back to this state; says what had been changed."""
        return list(self._restored())

    def _restored(self) -> Iterator[str]:
        if self.floats.restore():
            yield "the floating-point mode"
        if _directory() != self.directory:
            os.chdir(self.directory)
            yield "the working directory"
        if os.umask(self.mask) != self.mask:
            yield "the file mode mask"
        if _locale() != self.locale:
            _c().setlocale(locale.LC_ALL, self.locale)
            yield "the locale"
        if (now := _environment()) != self.environment:
            for name in {*now, *self.environment}:
                value = self.environment.get(name)
                _c().unsetenv(name) if value is None else _c().setenv(name, value, 1)
            yield "the environment"
        changed = [n for n in _SIGNALS if _handler(n)[:_POINTER] != self.handlers[n][:_POINTER]]
        for number in changed:
            _c().sigaction(int(number), self.handlers[number], None)
        if changed:
            yield f"what is done upon {', '.join(signal.Signals(number).name for number in changed)}"
        if _blocked() != self.blocked:
            signal.pthread_sigmask(signal.SIG_SETMASK, self.blocked)
            yield "which signals are blocked"
        if running := [timer for timer, runs in _timers().items() if runs and not self.timers[timer]]:
            for timer in running:
                signal.setitimer(timer, 0)
            yield "the timers"
        if (limits := _limits()) != self.limits:
            for kind, limit in self.limits.items():
                if limits[kind] != limit:
                    _set_limit(kind, limit)
            yield "the limits" if _limits() == self.limits else "the limits (what was lowered for good stays so)"


@contextmanager
def contained(who: str) -> Iterator[None]:
    """What components change in the process while the block lasts is changed back, and `who` is named.

    A supervised process whose own output was closed ends here: only its supervisor can still say by whom, and save the rows.
    """
    state, voices = ProcessState.now(), _voices()
    try:
        yield
    finally:
        journal = current()
        if journal and voices != _voices():
            journal.note(who, "a call that closed the files of the process")
            journal.enter(Phase.CALLING)
            os._exit(70)
        for what in state.restore():
            component_log.message(who, component_log.WARNING, f"changed {what} of the process; it was changed back")


def _voices() -> list[tuple[int, int]]:
    """What the streams of Python lead to, if they can be written."""
    found = []
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            place = os.fstat(stream.fileno())
            found.append((place.st_dev, place.st_ino))
    return found


@cache
def _c() -> Any:
    library = ctypes.CDLL(None)
    library.setlocale.restype = ctypes.c_char_p
    return library


def _directory() -> str:
    with suppress(OSError):
        return str(Path.cwd())
    return ""


def _locale() -> bytes:
    return bytes(_c().setlocale(locale.LC_ALL, None) or b"C")


def _environment() -> dict[bytes, bytes]:
    """The C library's environment; Python's own copy is not changed by foreign code."""
    if sys.platform != "linux":
        return {}
    entries = ctypes.POINTER(ctypes.c_char_p).in_dll(_c(), "environ")
    found, i = {}, 0
    while entries and entries[i] is not None:
        name, _, value = entries[i].partition(b"=")
        found[name] = value
        i += 1
    return found


def _handler(number: int) -> bytes:
    if sys.platform == "win32":
        return b""
    action = ctypes.create_string_buffer(_SIGACTION_SIZE)
    _c().sigaction(int(number), None, action)
    return action.raw


def _blocked() -> set[int]:
    return set() if sys.platform == "win32" else {*signal.pthread_sigmask(signal.SIG_BLOCK, ())}


def _timers() -> dict[int, bool]:
    """Whether the timers that send signals are running."""
    if sys.platform == "win32":
        return {}
    return {timer: any(signal.getitimer(timer)) for timer in (signal.ITIMER_REAL, signal.ITIMER_VIRTUAL, signal.ITIMER_PROF)}


def _limits() -> dict[int, tuple[int, int]]:
    if sys.platform == "win32":
        return {}
    kinds = (resource.RLIMIT_AS, resource.RLIMIT_CPU, resource.RLIMIT_DATA, resource.RLIMIT_FSIZE, resource.RLIMIT_NOFILE)
    return {kind: resource.getrlimit(kind) for kind in kinds}


def _set_limit(kind: int, limit: tuple[int, int]) -> None:
    """As far as that is allowed: what was given away for good stays away."""
    if sys.platform == "win32":
        return
    with suppress(ValueError, OSError):
        resource.setrlimit(kind, limit)
