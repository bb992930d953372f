"""Coefficients of the method of Dormand and Prince of order 5; see hybrid.h."""

from __future__ import annotations

from collections.abc import Sequence

#: times of the stages, weights of the slopes of each stage, and those of the error, as fractions of
#: the step
NODES = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0)
WEIGHTS: Sequence[Sequence[float]] = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
    (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
)
ERROR = (71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40)


def weighted_sum(weights: Sequence[float], slopes: Sequence[Sequence[float]], index: int) -> float:
    """Return the sum of the slopes of a state, each with its weight."""
    total = 0.0
    for weight, row in zip(weights, slopes, strict=True):
        if weight:
            total += weight * row[index]
    return total
