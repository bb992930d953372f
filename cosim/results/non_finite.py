"""Search for NaN and infinity in recorded signals."""

from __future__ import annotations

import logging
from itertools import islice

import numpy as np

from ..core.recording import Recording
from .files import iterate_chunks

#: number of rows that are examined at a time
_CHUNK_ROWS = 1 << 14
#: number of signals with a separate warning
_MAX_WARNINGS = 20


def warn_non_finite(recording: Recording) -> dict[str, float]:
    """Log a warning for every signal that has a value which is NaN or infinite.

    Args:
        recording: The recorded signals.

    Returns:
        Time (s) of the first such value by name of the signal, the earliest first.
    """
    rows = _first_rows(recording)
    logger = logging.getLogger("cosim")
    for name, row in islice(rows.items(), _MAX_WARNINGS):
        value, time = recording.columns[name][row], recording.time[row]
        logger.warning(
            "%s is %s at t = %.12g s, its first value that is not finite", name, value, time
        )
    if len(rows) > _MAX_WARNINGS:
        logger.warning("%d further recorded signals are not finite", len(rows) - _MAX_WARNINGS)
    return {name: float(recording.time[row]) for name, row in rows.items()}


def _first_rows(recording: Recording) -> dict[str, int]:
    """Return the first row that is not finite by name of the signal, in ascending order of the rows."""
    floats = {
        name: values for name, values in recording.columns.items() if values.dtype.kind == "f"
    }
    first_rows: dict[str, int] = {}
    for rows in iterate_chunks([recording.time, *floats.values()], _CHUNK_ROWS):
        for name in [name for name in floats if name not in first_rows]:
            finite = np.isfinite(floats[name][rows])
            if not finite.all():
                first_rows[name] = rows.start + int(np.argmin(finite))
    return dict(sorted(first_rows.items(), key=lambda item: item[1]))
