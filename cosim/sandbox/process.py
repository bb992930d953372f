"""A process on its own: session, end with its parent, empty input, limits."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
from pathlib import Path

from .landlock import PR_SET_NO_NEW_PRIVS

PR_SET_PDEATHSIG = 1

_LIBC = ctypes.CDLL(None, use_errno=True)


def detach(parent: int | None) -> None:
    """A session of its own, killed when the parent's thread that started it ends, no new privileges, nothing to read.

    Ends the process when `parent` is gone already.
    """
    if os.getpgrp() != os.getpid():
        os.setsid()
    _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if parent is not None and os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    _LIBC.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    if nothing != 0:
        os.close(nothing)


def limit(memory: int, open_files: int, file_size: int, cpu_seconds: int | None) -> None:
    """Lower the limits of this process; `memory` in bytes beyond what is mapped already. No core file is written."""
    _lower(resource.RLIMIT_AS, mapped() + memory)
    _lower(resource.RLIMIT_NOFILE, open_files)
    _lower(resource.RLIMIT_FSIZE, file_size)
    _lower(resource.RLIMIT_CORE, 0)
    if cpu_seconds is not None:
        _lower(resource.RLIMIT_CPU, cpu_seconds)


def _lower(kind: int, value: int) -> None:
    """Soft and hard limit; a hard limit that is lower already stays."""
    _, hard = resource.getrlimit(kind)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(kind, (value, value))


def mapped() -> int:
    """Address space of this process in bytes."""
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def threads() -> int:
    """Number of threads of this process."""
    return len(list(Path("/proc/self/task").iterdir()))
