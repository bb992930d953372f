"""Points of convex pieces of collision shapes."""

from __future__ import annotations

import numpy as np

#: largest number of points of a convex piece
MAX_POINTS = 64


def outermost_points(points: np.ndarray) -> np.ndarray:
    """Return at most MAX_POINTS of the points (n, 3).

    Those farthest in directions that lie evenly on a sphere.
    """
    if len(points) <= MAX_POINTS:
        return points
    height = 1 - 2 * (np.arange(MAX_POINTS) + 0.5) / MAX_POINTS
    angle, radius = np.pi * (1 + 5**0.5) * np.arange(MAX_POINTS), np.sqrt(1 - height**2)
    directions = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    chosen: np.ndarray = points[np.unique(np.argmax(points @ directions.T, axis=0))]
    return chosen
