"""Which vehicles may meet something in the coming step, and how far the others may go until that has to be asked again.

A vehicle is enclosed in a box (world axes) that holds it in every attitude it can take. Two vehicles, or a vehicle and a
platform, are near each other if the boxes that they sweep in the step come closer than NEAR. Vehicles that are far from each
other stay so while each moves at most half of their distance along the axis that separates them; `leash` (m) is the shortest
of these ways along each axis, measured from `anchor`. So the answer for every vehicle depends on the present step alone, and
the leashes only save the asking.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..vehicles.common.shapes import Vector

#: Bullet takes part where boxes are closer (m); its own contact begins at 0
NEAR_DISTANCE = 0.05

_endpoint_struct = struct.Struct("6d")


class BoundingBox(NamedTuple):
    """The lowest and the highest corner of a box, from the centre of mass of the vehicle (m)."""

    low: Vector
    high: Vector


class Clearance:
    """Distances between vehicles and from them to platforms, whose `platforms` are enclosures in the world frame.

    `path` has for each vehicle its centre of mass at the start and at the foreseen end of the step (6 numbers); `anchor` and
    `leash` (3 numbers each) are filled in.
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
        self._vehicles, self._platforms = (np.array(boxes, np.float64).reshape(-1, 2, 3) for boxes in (vehicles, platforms))
        self._endpoints, self._reference_position, self._safe_distance = (
            endpoints.reshape(count, 2, 3),
            reference_position.reshape(count, 3),
            safe_distance.reshape(count, 3),
        )
        #: a platform leaves the whole distance to the vehicle
        self._gap_fraction = np.concatenate([np.full(count, 0.5), np.ones(len(platforms))])[:, None]
        self._indices = np.arange(count)
        #: who was near whom at the last survey, by the places among vehicles and platforms; None: nobody knows
        self._near_pairs: list[tuple[int, int]] | None = None
        self._endpoint_data: Any = endpoints.data
        self._boxes = [(*low, *high) for low, high in np.concatenate([self._vehicles, self._platforms]).tolist()]

    def find_near_vehicles(self) -> list[bool]:
        """For each vehicle whether it is near something; sets anchors and leashes."""
        gaps = self._gaps()
        apart = gaps.max(axis=2, keepdims=True)
        near = apart < NEAR_DISTANCE
        self._near_pairs = [(one, other) for one, other in np.argwhere(np.triu(near[:, :, 0], 1)).tolist()]
        self._safe_distance[:] = np.where((gaps < apart) | near, math.inf, (gaps - NEAR_DISTANCE) * self._gap_fraction).min(
            axis=1
        )
        self._reference_position[:] = self._endpoints[:, 1]
        return near.any(axis=(1, 2)).tolist()

    def invalidate(self) -> None:
        """Vehicles have been placed elsewhere."""
        self._near_pairs = None

    def is_valid(self) -> bool:
        """Whether all that were near each other at the last survey still are: then, within leashes, it would find the same."""
        return self._near_pairs is not None and all(self._gap(*pair) < NEAR_DISTANCE for pair in self._near_pairs)

    def _gap(self, vehicle: int, other: int) -> float:
        """Distance of a vehicle to a vehicle or platform along the axis that separates them most, as in `_gaps`."""
        a, b = self._swept_box(vehicle), self._swept_box(other)
        return max(a[0] - b[3], b[0] - a[3], a[1] - b[4], b[1] - a[4], a[2] - b[5], b[2] - a[5])

    def _swept_box(self, number: int) -> tuple[float, ...]:
        """The lowest and the highest corner of what a vehicle sweeps in the step, or of a platform."""
        box = self._boxes[number]
        if number >= len(self._indices):
            return box
        x, y, z, end_x, end_y, end_z = _endpoint_struct.unpack_from(self._endpoint_data, number * _endpoint_struct.size)
        x, end_x = (x, end_x) if x < end_x else (end_x, x)
        y, end_y = (y, end_y) if y < end_y else (end_y, y)
        z, end_z = (z, end_z) if z < end_z else (end_z, z)
        return x + box[0], y + box[1], z + box[2], end_x + box[3], end_y + box[4], end_z + box[5]

    def _gaps(self) -> np.ndarray:
        """Distances along the axes (last index) of each vehicle (first) to each vehicle and platform (second)."""
        low = np.concatenate([self._endpoints.min(axis=1) + self._vehicles[:, 0], self._platforms[:, 0]])
        high = np.concatenate([self._endpoints.max(axis=1) + self._vehicles[:, 1], self._platforms[:, 1]])
        count = len(self._vehicles)
        gaps = np.maximum(low[:count, None] - high, low - high[:count, None])
        gaps[self._indices, self._indices] = math.inf
        return gaps
