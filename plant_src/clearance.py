"""Which vehicles may meet something in the coming step, and how far the others may go until that has to be asked again.

A vehicle is enclosed in a box (world axes) that holds it in every attitude it can take. Two vehicles, or a vehicle and a
platform, are near each other if the boxes that they sweep in the step come closer than NEAR. Vehicles that are far from each
other stay so while each moves at most half of their distance along the axis that separates them; `leash` (m) is the shortest
of these ways along each axis, measured from `anchor`. So the answer for every vehicle depends on the present step alone, and
the leashes only save the asking.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .vehicles.shapes import Vector

#: Bullet takes part where boxes are closer (m); its own contact begins at 0
NEAR = 0.05


class Enclosure(NamedTuple):
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
        vehicles: Sequence[Enclosure],
        platforms: Sequence[Enclosure],
        path: np.ndarray,
        anchor: np.ndarray,
        leash: np.ndarray,
    ):
        count = len(vehicles)
        self._vehicles, self._platforms = (np.array(boxes, np.float64).reshape(-1, 2, 3) for boxes in (vehicles, platforms))
        self._path, self._anchor, self._leash = path.reshape(count, 2, 3), anchor.reshape(count, 3), leash.reshape(count, 3)
        #: a platform leaves the whole distance to the vehicle
        self._share = np.concatenate([np.full(count, 0.5), np.ones(len(platforms))])[:, None]
        self._itself = np.arange(count)

    def survey(self) -> list[bool]:
        """For each vehicle whether it is near something; sets anchors and leashes."""
        gaps = self._gaps()
        apart = gaps.max(axis=2, keepdims=True)
        near = apart < NEAR
        self._leash[:] = np.where((gaps < apart) | near, math.inf, (gaps - NEAR) * self._share).min(axis=1)
        self._anchor[:] = self._path[:, 1]
        return near.any(axis=(1, 2)).tolist()

    def _gaps(self) -> np.ndarray:
        """Distances along the axes (last index) of each vehicle (first) to each vehicle and platform (second)."""
        low = np.concatenate([self._path.min(axis=1) + self._vehicles[:, 0], self._platforms[:, 0]])
        high = np.concatenate([self._path.max(axis=1) + self._vehicles[:, 1], self._platforms[:, 1]])
        count = len(self._vehicles)
        gaps = np.maximum(low[:count, None] - high, low - high[:count, None])
        gaps[self._itself, self._itself] = math.inf
        return gaps
