"""Session, resource limits and end of a child process."""

import ctypes
import os
import resource
import signal
import sys
from pathlib import Path

PR_SET_PDEATHSIG, PR_SET_NO_NEW_PRIVS, PR_GET_NO_NEW_PRIVS = 1, 38, 39


def detach(parent: int | None) -> None:
    """Enter a new session, give up gaining privileges, and connect standard input to /dev/null.

    On Linux the process is killed when the thread that started it ends.

    Args:
        parent: Process id of the parent; the process ends at once if it is no longer its parent.
            None: no check.
    """
    if os.getpgrp() != os.getpid():
        os.setsid()
    _prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if parent is not None and os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGKILL)
    _prctl(PR_SET_NO_NEW_PRIVS, 1)
    null = os.open(os.devnull, os.O_RDONLY)
    os.dup2(null, 0)
    if null != 0:
        os.close(null)


def skip_exit_handlers() -> None:
    """End this process at once if foreign code calls exit(), after its buffered output is written.

    The exit handlers that a forked process inherits belong to libraries whose threads and
    descriptors it lacks: they may crash or never end. Systems whose C library lacks on_exit run
    them.
    """
    library = ctypes.CDLL(None)
    if hasattr(library, "on_exit"):
        library.on_exit(library._exit, None)
        library.__cxa_atexit(library.fflush, None, None)  # comes first, and writes all streams


def lower_limit(kind: int, value: int | None) -> None:
    """Set the soft and the hard limit of a resource (`resource.RLIMIT_*`); None changes nothing.

    A lower hard limit is kept.
    """
    if value is None:
        return
    _, hard = resource.getrlimit(kind)
    value = value if hard == resource.RLIM_INFINITY else min(value, hard)
    resource.setrlimit(kind, (value, value))


def no_new_privileges() -> bool:
    """Return whether this process has given up gaining privileges."""
    return _prctl(PR_GET_NO_NEW_PRIVS, 0) == 1


def _prctl(option: int, value: int) -> int:
    """Call prctl; return -1 on systems other than Linux."""
    return int(ctypes.CDLL(None).prctl(option, value, 0, 0, 0)) if sys.platform == "linux" else -1


def mapped_size() -> int:
    """Return the address space of this process (bytes); 0 on systems other than Linux."""
    if sys.platform != "linux":
        return 0
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def thread_count() -> int:
    """Return the number of threads of this process."""
    return len(list(Path("/proc/self/task").iterdir()))
