"""Damped Newton's method for small systems of equations."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

#: largest number of halvings of one step
MAX_HALVINGS = 20
#: a solution at which the residuals cannot be reduced is accepted if they are at most this many
#: times the tolerance
ACCEPTED_MULTIPLE = 1000.0


class Solution(NamedTuple):
    """Last values and their residuals, each of shape (n,)."""

    values: np.ndarray
    residuals: np.ndarray
    converged: bool


def solve(
    residuals: Callable[[np.ndarray], np.ndarray],
    jacobian: Callable[[np.ndarray, np.ndarray], np.ndarray],
    start: np.ndarray,
    tolerance: np.ndarray | float,
    limit: int,
) -> Solution:
    """Solve residuals(values) = 0; a step that does not reduce the residuals is halved.

    Args:
        residuals: Function of the values.
        jacobian: Derivative of the residuals, shape (n, n), from values and residuals.
        start: First values, shape (n,).
        tolerance: The values v are a solution if each residual is at most tolerance * (1 + |v|).
        limit: Largest number of steps.
    """
    values, found = start, residuals(start)
    scale = 1.0 + np.abs(start)
    for _ in range(limit):
        if _are_small(found, values, tolerance):
            return Solution(values, found, True)
        matrix = jacobian(values, found)
        if not (np.isfinite(matrix).all() and np.isfinite(found).all()):
            break
        step = np.linalg.lstsq(matrix, -found, rcond=None)[0]
        for _ in range(MAX_HALVINGS):
            trial = values + step
            new = residuals(trial)
            if np.linalg.norm(new / scale) < np.linalg.norm(found / scale):
                break
            step = step / 2
        else:
            break
        values, found = trial, new
    return Solution(values, found, _are_small(found, values, ACCEPTED_MULTIPLE * tolerance))


def difference_jacobian(
    residuals: Callable[[np.ndarray], np.ndarray],
) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Return the Jacobian of a function by forward differences, as `solve` needs it."""

    def jacobian(values: np.ndarray, found: np.ndarray) -> np.ndarray:
        columns = []
        for i, step in enumerate(np.sqrt(np.finfo(np.float64).eps) * (1.0 + np.abs(values))):
            moved = values.copy()
            moved[i] += step
            columns.append((residuals(moved) - found) / (moved[i] - values[i]))
        return np.column_stack(columns)

    return jacobian


def _are_small(residuals: np.ndarray, values: np.ndarray, tolerance: np.ndarray | float) -> bool:
    return bool((np.abs(residuals) <= tolerance * (1.0 + np.abs(values))).all())
