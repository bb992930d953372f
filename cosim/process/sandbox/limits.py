"""A process on its own: session, end with its parent, empty input, limits."""

from __future__ import annotations

import ctypes
import os
import resource
import signal
import sys
from pathlib import Path

PR_SET_PDEATHSIG, PR_SET_NO_NEW_PRIVS, PR_GET_NO_NEW_PRIVS = 1, 38, 39


def detach(parent: int | None) -> None:
    """A session of its own, killed when the parent's thread that started it ends (Linux), no new privileges, nothing to read.

    Ends the process when `parent` is gone already.
    """
    if os.getpgrp() != os.getpid():
        os.setsid()
    _prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if parent is not None and os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    _prctl(PR_SET_NO_NEW_PRIVS, 1)
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    if nothing != 0:
        os.close(nothing)


def set_limits(memory: int, open_files: int, file_size: int, cpu_seconds: int | None) -> None:
    """Lower the limits of this process; `memory` in bytes beyond what is mapped already. No core file is written."""
    lower_limit(resource.RLIMIT_AS, mapped_size() + memory)
    lower_limit(resource.RLIMIT_NOFILE, open_files)
    lower_limit(resource.RLIMIT_FSIZE, file_size)
    lower_limit(resource.RLIMIT_CORE, 0)
    if cpu_seconds is not None:
        lower_limit(resource.RLIMIT_CPU, cpu_seconds)


def lower_limit(kind: int, value: int) -> None:
    """Soft and hard limit; a hard limit that is lower already stays."""
    _, hard = resource.getrlimit(kind)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(kind, (value, value))


def no_new_privileges() -> bool:
    """Whether this process has given up to gain privileges."""
    return _prctl(PR_GET_NO_NEW_PRIVS, 0) == 1


def _prctl(option: int, value: int) -> int:
    """prctl, which only Linux has."""
    return int(ctypes.CDLL(None).prctl(option, value, 0, 0, 0)) if sys.platform == "linux" else -1


def mapped_size() -> int:
    """Address space of this process in bytes (0 where the system does not say)."""
    if sys.platform != "linux":
        return 0
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def thread_count() -> int:
    """Number of threads of this process."""
    return len(list(Path("/proc/self/task").iterdir()))
