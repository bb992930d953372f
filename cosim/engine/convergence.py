"""Convergence test of the fixed-point iterations, and the shortened lists of names in their messages."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

#: names shown in a message about several components or outputs
MAX_NAMES_SHOWN = 8


def exceeds_tolerance(old: np.ndarray, new: np.ndarray, tolerance: float) -> np.ndarray:
    """Return a Boolean mask of the floats that changed by more than `tolerance * (1 + abs(new))`.

    A value that is NaN or infinite always counts as changed.
    """
    with np.errstate(invalid="ignore"):
        changed: np.ndarray = ~(np.abs(new - old) <= tolerance * (1 + np.abs(new)))
    return changed


def abbreviate_names(names: Iterable[str]) -> str:
    """Return the distinct names, separated by commas; of a long list, the first names and the total number."""
    distinct = list(dict.fromkeys(names))
    total = f", ... ({len(distinct)} in all)" if len(distinct) > MAX_NAMES_SHOWN else ""
    return ", ".join(distinct[:MAX_NAMES_SHOWN]) + total
