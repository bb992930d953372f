"""Convergence test of the fixed-point iterations."""

from __future__ import annotations

import numpy as np


def exceeds_tolerance(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    """Return a Boolean mask of the floats that changed by more than `tolerance * (1 + abs(new))`.

    A value that is NaN or infinite always counts as changed.
    """
    with np.errstate(invalid="ignore"):
        changed: np.ndarray = ~(np.abs(new - old) <= tolerance * (1 + np.abs(new)))
    return changed
