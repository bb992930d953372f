"""Triangles of boxes, cylinders and spheres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

_SIDES = 24  # of a cylinder or sphere


def box_triangles(edges: Sequence[float]) -> np.ndarray:
    """Return the triangles of a box with these edges (m) around the origin, shape (12, 3, 3)."""
    ring = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return _stacked(
        np.array([[(x, y, z) for x, y in ring] for z in (-1, 1)]) * np.asarray(edges) / 2
    )


def cylinder_triangles(radius: float, length: float) -> np.ndarray:
    """Return the triangles of a cylinder along z around the origin (m), shape (n, 3, 3)."""
    return _stacked(np.stack([_ring(radius, -length / 2), _ring(radius, length / 2)]))


def sphere_triangles(radius: float) -> np.ndarray:
    """Return the triangles of a sphere around the origin (m), shape (n, 3, 3)."""
    angles = np.linspace(-np.pi / 2, np.pi / 2, _SIDES // 2 + 1)[1:-1]
    return _stacked(
        np.stack([_ring(radius * np.cos(angle), radius * np.sin(angle)) for angle in angles])
    )


def _ring(radius: float, height: float) -> np.ndarray:
    angles = np.arange(_SIDES) * 2 * np.pi / _SIDES
    return np.column_stack(
        [radius * np.cos(angles), radius * np.sin(angles), np.full(_SIDES, height)]
    )


def _stacked(rings: np.ndarray) -> np.ndarray:
    """Return the closed surface through rings of points from bottom to top, seen counter-clockwise from above (levels, n, 3)."""
    following = np.roll(rings, -1, axis=1)
    lower = np.stack([rings[:-1], following[:-1], following[1:]], axis=2)
    upper = np.stack([rings[:-1], following[1:], rings[1:]], axis=2)
    bottom, top = (
        np.stack(
            [np.broadcast_to(ring.mean(axis=0), ring.shape), ring, np.roll(ring, -1, axis=0)],
            axis=1,
        )
        for ring in (rings[0, ::-1], rings[-1])
    )
    return np.concatenate([lower.reshape(-1, 3, 3), upper.reshape(-1, 3, 3), bottom, top])
