"""Contact points that Bullet must forget, so that saved states are restored bit for bit.

Bullet keeps contact points from one step to the next, and starts its solution with their last
impulses. Its saved states hold the points of one pair of shapes for each pair of bodies. While
several shapes of a vehicle can touch one other body, for example both hulls a wall, Bullet
therefore computes all points afresh in each step, from poses and velocities alone.

A vehicle of one shape on a vehicle of several shapes, for example a multirotor on a deck, does not
cause this.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..placement import VehiclePlacement
from .body import ContactBody
from .clearance import NEAR_DISTANCE, BoundingBox
from .client import pybullet


class ContactMemory:
    """Detection of vehicles of which several shapes can touch one other body.

    Args:
        client: Number of the Bullet client.
        bodies: Contact body of each vehicle.
        vehicles: Settings of each vehicle.
        fixed: Bounding boxes of platforms and obstacles.

    Attributes:
        watched_pairs: Pairs that `is_unsafe` examines.
    """

    def __init__(
        self,
        client: int,
        bodies: Sequence[ContactBody],
        vehicles: Sequence[VehiclePlacement],
        fixed: Sequence[BoundingBox],
    ):
        self._client, self._numbers, self._fixed = client, [body.body_id for body in bodies], fixed
        self._has_several_shapes = [len(vehicle.body.boxes) > 1 for vehicle in vehicles]
        self.watched_pairs: Sequence[tuple[int, int]] = ()

    def watch(self, near_pairs: Sequence[tuple[int, int]]) -> None:
        """Set the pairs that `is_unsafe` examines.

        Args:
            near_pairs: Bodies that are near each other, as indices of vehicles, then fixed bodies.
        """
        several = self._has_several_shapes
        count = len(several)
        self.watched_pairs = [
            (a, b) for a, b in near_pairs if several[a] and (b >= count or several[b])
        ]

    def is_unsafe(self) -> bool:
        """Return whether several shapes of a vehicle can touch one other body at the start of the step."""
        return any(self._is_near(*pair) for pair in self.watched_pairs)

    def _is_near(self, one: int, other: int) -> bool:
        (low, high), (other_low, other_high) = self._box(one), self._box(other)
        gaps = (
            max(c - b, a - d) for a, b, c, d in zip(low, high, other_low, other_high, strict=True)
        )
        return max(gaps) < NEAR_DISTANCE

    def _box(self, index: int) -> BoundingBox:
        if index >= len(self._numbers):
            return self._fixed[index - len(self._numbers)]
        return BoundingBox(*pybullet.getAABB(self._numbers[index], -1, self._client))
