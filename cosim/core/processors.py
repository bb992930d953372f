"""Number of processors available to this process."""

from __future__ import annotations

import os


def available_processors() -> int:
    """Return how many processors this process may use.

    Its CPU affinity may exclude some of the machine's.
    """
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
