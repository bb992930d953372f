"""Time that a process has waited for a processor."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path


def waiting_time(process: int) -> float:
    """Return how long (s) the main thread of a process has been ready to run without having a processor.

    Args:
        process: Process id.

    Returns:
        The time since the start of the thread; 0 where the system does not tell it (not Linux, or /proc is not readable).
    """
    with suppress(OSError, ValueError, IndexError):
        return int(Path(f"/proc/{process}/schedstat").read_text("ascii").split()[1]) * 1e-9
    return 0.0
