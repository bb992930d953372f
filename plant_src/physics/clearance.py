"""Clearance: detection of the vehicles that may touch something in the next step.

Every vehicle has a bounding box (world axes) that contains it at all attitudes. Two vehicles, or a
vehicle and a platform, are near each other if the boxes swept during the step come closer than
NEAR_DISTANCE. Vehicles that are not near each other remain so as long as each moves at most half of
the gap along the axis with the largest gap. `safe_distance` (m) is the smallest of these limits per
axis, measured from `reference_position`. The result for each vehicle thus depends on the present
step alone; safe distances only avoid repeating the search.
"""

import math
import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..vehicles.common.shapes import Vector

#: gap between swept boxes below which Bullet takes part (m); contact in Bullet begins at 0
NEAR_DISTANCE = 0.05

_endpoint_struct = struct.Struct("6d")


class BoundingBox(NamedTuple):
    """Lowest and highest corner of a box (m).

    That of a vehicle is relative to its centre of mass, that of a platform in the world frame.
    """

    low: Vector
    high: Vector


class Clearance:
    """Gaps between vehicles, and between vehicles and platforms.

    All arrays are contiguous and shared with the compiled equations.

    Args:
        vehicles: Bounding box of each vehicle.
        platforms: Bounding box of each platform.
        endpoints: Input: centres of mass at the start and the predicted end of the step (m), 6
            numbers for each vehicle.
        reference_position: Output: positions from which the safe distances count (m), 3 numbers for
            each vehicle.
        safe_distance: Output: safe distances along x, y and z (m), 3 numbers for each vehicle.

    Attributes:
        near_pairs: Near pairs of the last search, as indices of vehicles, then platforms; None
            before the first search.
    """

    def __init__(
        self,
        vehicles: Sequence[BoundingBox],
        platforms: Sequence[BoundingBox],
        endpoints: np.ndarray,
        reference_position: np.ndarray,
        safe_distance: np.ndarray,
    ):
        count = len(vehicles)
        self._vehicles, self._platforms = (
            np.array(boxes, np.float64).reshape(-1, 2, 3) for boxes in (vehicles, platforms)
        )
        self._endpoints = endpoints.reshape(count, 2, 3)
        self._reference_position, self._safe_distance = (
            reference_position.reshape(count, 3),
            safe_distance.reshape(count, 3),
        )
        #: share of the gap that a vehicle may use: half of it beside a vehicle, all of it beside a
        #: platform
        self._gap_fraction = np.concatenate([np.full(count, 0.5), np.ones(len(platforms))])[:, None]
        self._indices = np.arange(count)
        self.near_pairs: list[tuple[int, int]] | None = None
        self._endpoint_data: Any = endpoints.data
        self._boxes = [
            (*low, *high)
            for low, high in np.concatenate([self._vehicles, self._platforms]).tolist()
        ]

    def find_near_vehicles(self) -> list[bool]:
        """Return which vehicles are near something, and update their safe boxes."""
        gaps = self._gaps()
        largest_gap = gaps.max(axis=2, keepdims=True)
        near = largest_gap < NEAR_DISTANCE
        self.near_pairs = [
            (one, other) for one, other in np.argwhere(np.triu(near[:, :, 0], 1)).tolist()
        ]
        # Two boxes stay apart as long as they are apart along one axis. So only the axis with the
        # largest gap limits the motion: until two vehicles have used half of that gap each, they
        # cannot meet, however they move along the other axes.
        limits = np.where(
            (gaps < largest_gap) | near, math.inf, (gaps - NEAR_DISTANCE) * self._gap_fraction
        )
        self._safe_distance[:] = limits.min(axis=1)
        self._reference_position[:] = self._endpoints[:, 1]
        is_near: list[bool] = near.any(axis=(1, 2)).tolist()
        return is_near

    def invalidate(self) -> None:
        """Discard the result of the last search, because vehicles have been moved."""
        self.near_pairs = None

    def is_valid(self) -> bool:
        """Return whether all near pairs of the last search are still near.

        Within the safe distances a new search would then find the same vehicles.
        """
        return self.near_pairs is not None and all(
            self._gap(*pair) < NEAR_DISTANCE for pair in self.near_pairs
        )

    def _gap(self, vehicle: int, other: int) -> float:
        """Return the largest gap along an axis (m) of a vehicle to another one or a platform."""
        # plain numbers: `is_valid` examines few pairs in each step, where NumPy takes longer
        a, b = self._swept_box(vehicle), self._swept_box(other)
        return max(a[0] - b[3], b[0] - a[3], a[1] - b[4], b[1] - a[4], a[2] - b[5], b[2] - a[5])

    def _swept_box(self, index: int) -> tuple[float, ...]:
        """Return the corners (m, world) of the box that a vehicle sweeps, or of a platform."""
        box = self._boxes[index]
        if index >= len(self._indices):
            return box
        x, y, z, end_x, end_y, end_z = _endpoint_struct.unpack_from(
            self._endpoint_data, index * _endpoint_struct.size
        )
        x, end_x = (x, end_x) if x < end_x else (end_x, x)
        y, end_y = (y, end_y) if y < end_y else (end_y, y)
        z, end_z = (z, end_z) if z < end_z else (end_z, z)
        return x + box[0], y + box[1], z + box[2], end_x + box[3], end_y + box[4], end_z + box[5]

    def _gaps(self) -> np.ndarray:
        """Return the gaps (m) of each vehicle to each vehicle and platform along each axis.

        The shape is (vehicles, vehicles + platforms, axes).
        """
        low = np.concatenate(
            [self._endpoints.min(axis=1) + self._vehicles[:, 0], self._platforms[:, 0]]
        )
        high = np.concatenate(
            [self._endpoints.max(axis=1) + self._vehicles[:, 1], self._platforms[:, 1]]
        )
        count = len(self._vehicles)
        gaps: np.ndarray = np.maximum(low[:count, None] - high, low - high[:count, None])
        gaps[self._indices, self._indices] = math.inf
        return gaps
