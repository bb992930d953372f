"""Minimal state-space realization of measured impulse responses.

The method is the eigensystem realization algorithm (J.-N. Juang and R. S. Pappa, J. Guidance 8
(1985), 620-627). The lags of the rows and columns of the Hankel matrix grow geometrically, so that
a small matrix covers fast and slow modes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

#: fractions of the largest singular value below which the others may be noise of the measured
#: responses
_TOLERANCES = 10.0 ** -np.arange(8, 2, -1)
#: factor by which the misfit of a lower order may exceed the smallest misfit
_MISFIT_FACTOR = 3.0
#: largest tolerance
_MAX_TOLERANCE = 1e-3


class Realization(NamedTuple):
    """Matrices of x[k+1] = A x[k] + B u[k], y[k] = C x[k] + D u[k]."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray

    def impulse_response(self, count: int) -> np.ndarray:
        """Return D, C B, C A B, ..., shape (count, outputs, inputs)."""
        response, state = [self.d], self.b
        for _ in range(count - 1):
            response.append(self.c @ state)
            state = self.a @ state
        return np.array(response)


def realize(
    response: np.ndarray, max_order: int | None = None, tolerance: float = 0.0
) -> Realization:
    """Return a balanced realization of the lowest order that reproduces a response about as well as any.

    Args:
        response: Impulse response D, C B, C A B, ..., shape (steps, outputs, inputs).
        max_order: Largest order; None: no limit.
        tolerance: Misfit of about this size is good enough, because the response itself varies as much; at most 0.001 counts.
    """
    rows, columns = _scales(response)
    scaled = response / rows[:, None] / columns
    lags = _lags(len(response))
    now, later = _hankel(scaled[1:], lags), _hankel(scaled[2:], lags)
    left, singular, right = np.linalg.svd(now, full_matrices=False)
    outputs, inputs = response.shape[1:]

    def realization(order: int) -> Realization:
        root = np.sqrt(singular[:order])
        reach, show = root[:, None] * right[:order], left[:, :order] * root
        a = (left[:, :order] / root).T @ later @ (right[:order].T / root)
        return Realization(
            a, reach[:, :inputs] * columns, show[:outputs] * rows[:, None], response[0]
        )

    orders = {
        int(np.sum(singular > tolerance * singular[0])) if singular[0] > 0 else 0
        for tolerance in _TOLERANCES
    }
    found = [
        realization(order)
        for order in sorted(
            {order if max_order is None else min(order, max_order) for order in orders}
        )
    ]
    misfits = [misfit(each, response) for each in found]
    enough = _MISFIT_FACTOR * max(min(misfits), min(tolerance, _MAX_TOLERANCE))
    return next(each for each, value in zip(found, misfits, strict=True) if value <= enough)


def misfit(realization: Realization, response: np.ndarray) -> float:
    """Return the largest error of the impulse response of a realization, as a fraction of the peak of each response."""
    peaks = np.abs(response).max(0)
    peaks[peaks == 0] = 1
    with np.errstate(over="ignore", invalid="ignore"):
        errors = np.abs(realization.impulse_response(len(response)) - response) / peaks
    return float(np.max(np.nan_to_num(errors, nan=np.inf), initial=0))


def _scales(response: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return factors of outputs and inputs that make the largest responses of all of them about 1."""
    peaks = np.abs(response).max(0)
    rows = peaks.max(1)
    rows[rows == 0] = 1
    columns = (peaks / rows[:, None]).max(0)
    columns[columns == 0] = 1
    return rows, columns


def _lags(count: int) -> np.ndarray:
    """Return increasing lags from 0, of which two together and 2 more are less than `count`."""
    largest = max(0, (count - 3) // 2)
    lags = np.unique(np.round(1.35 ** np.arange(0, 60)).astype(int) - 1)
    return np.asarray(lags[lags <= largest])


def _hankel(response: np.ndarray, lags: np.ndarray) -> np.ndarray:
    """Return the matrix of the blocks response[i + j] for all lags i and j."""
    blocks = response[lags[:, None] + lags[None, :]]
    count, _, outputs, inputs = blocks.shape
    return np.asarray(blocks.transpose(0, 2, 1, 3).reshape(count * outputs, count * inputs))
