"""State of other processes, read from /proc."""

import os
from contextlib import suppress
from pathlib import Path


def waiting_time(process: int) -> float:
    """Return how long (s) the main thread of a process has waited for a processor.

    Args:
        process: Process id.

    Returns:
        The time since the start of the thread; 0 where the system does not tell it (not Linux, or
        /proc is not readable).
    """
    with suppress(OSError, ValueError, IndexError):
        return int(Path(f"/proc/{process}/schedstat").read_text("ascii").split()[1]) * 1e-9
    return 0.0


def is_stopped(process: int) -> bool:
    """Return whether a process is stopped (SIGSTOP); False on systems that do not report it."""
    return _process_state(process) == "T"


def has_ended(process: int) -> bool:
    """Return whether a process has ended, waited for or not.

    False on systems that do not report it.
    """
    return _process_state(process) in ("Z", "X", "")


def _process_state(process: int) -> str:
    """Return the letter of a process's state in /proc.

    "" if it does not exist, "?" on systems without /proc.
    """
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(") ")[2][:1]
    except OSError:
        return "" if Path("/proc/self/stat").exists() else "?"


def child_processes() -> list[int]:
    """Return the ids of the children of this process; empty where the system does not list them."""
    try:
        return [
            int(word)
            for word in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
        ]
    except OSError:
        return []
