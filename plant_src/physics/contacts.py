"""Contact outputs of the vehicles, and contact points that Bullet must forget.

Bullet keeps contact points from one step to the next, and starts its solution with their last
impulses. Its saved states hold the points of one pair of shapes for each pair of bodies. While
several shapes of a vehicle can touch one other body, for example both hulls a wall, Bullet
therefore computes all points afresh in each step, from poses and velocities alone. So saved states
are restored bit for bit.

A vehicle of one shape on a vehicle of several shapes, for example a multirotor on a deck, does not
cause this.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from ..placement import VehiclePlacement
from .body import ContactBody, PlanarBody
from .bullet import pybullet
from .clearance import NEAR_DISTANCE, BoundingBox
from .failures import FLAG_COUNT, ON_VESSEL, TOUCHING, Failures

_NO_MOTION: Any = np.zeros(3).data  # of a platform
_ALL_BODIES = -1, -1, -2, -2  # Bullet's defaults for two bodies and their links
_BODY_A, _BODY_END, _DISTANCE, _NORMAL_FORCE = 1, 3, 8, 9  # indices in Bullet's contact points
_unpack_vector = struct.Struct("3d").unpack_from


def overlap_depths(client: int) -> dict[tuple[int, int], float]:
    """Return the depth (m) of the deepest contact point of each pair of bodies now."""
    pybullet.performCollisionDetection(client)
    depths: dict[tuple[int, int], float] = {}
    for point in pybullet.getContactPoints(physicsClientId=client):
        pair = point[_BODY_A:_BODY_END]
        depths[pair] = max(depths.get(pair, 0.0), -point[_DISTANCE])
    return depths


def touching_pairs(client: int) -> frozenset[tuple[int, int]]:
    """Return the pairs of bodies between which Bullet keeps contact points."""
    return frozenset(
        point[_BODY_A:_BODY_END] for point in pybullet.getContactPoints(*_ALL_BODIES, client)
    )


class _Pair(NamedTuple):
    """Two bodies in contact.

    Attributes:
        forces: Indices of the forces among the outputs.
        flags: Indices of the flags.
        velocity_a: Velocity of one body before the contact (m/s).
        velocity_b: Velocity of the other one.
        vertical_a: Factor on the vertical velocity of one body; 0 for a planar vessel, whose lift
            is no motion.
        vertical_b: Factor on the vertical velocity of the other one.
        squared_limit: Square of the relative speed above which a collision is a crash.
    """

    forces: Sequence[int]
    flags: Sequence[int]
    velocity_a: Any
    velocity_b: Any
    vertical_a: float
    vertical_b: float
    squared_limit: float


class Contacts:
    """Contact outputs: normal force (N), mean over the component's step, and flags.

    Args:
        client: Number of the Bullet client.
        bodies: All vehicles.
        outputs: Real outputs of all vehicles in order; the last one of each vehicle is the contact
            force.
        flags: Flags of each vehicle (`failures.py`), shape (vehicles, FLAG_COUNT).
        failures: Failures, to which crashes are added.

    Attributes:
        has_contacts: Whether the outputs may contain contacts that `clear` would remove.
    """

    def __init__(
        self,
        client: int,
        bodies: Sequence[ContactBody],
        outputs: np.ndarray,
        flags: np.ndarray,
        failures: Failures,
    ):
        self._query, self._failures = (*_ALL_BODIES, client), failures
        self.has_contacts = False
        # memoryviews: setting an element takes half as long as with NumPy
        self._outputs: Any = outputs.data
        self._flags: Any = flags.reshape(-1).data
        self._permanent_flags, self._touching = (
            failures.permanent_flags.reshape(-1).data,
            flags[:, TOUCHING].data,
        )
        ends = accumulate(map(len, (body.outputs for body in bodies)))
        self._force_indices = [end - 1 for end in ends]
        self._bodies = {body.body_id: body for body in bodies}
        self._vehicle_indices = {body.body_id: k for k, body in enumerate(bodies)}
        self._vessels = {body.body_id for body in bodies if body.model.is_vessel}
        self._pairs: dict[tuple[int, int], _Pair] = {}

    def clear(self) -> None:
        """Set all contact forces to 0 and all flags but those of failures to false."""
        self.has_contacts = False
        self._flags[:] = self._permanent_flags
        for index in self._force_indices:
            self._outputs[index] = 0.0

    def add(self, step_fraction: float) -> int:
        """Add the contacts of Bullet's last step to the outputs.

        Args:
            step_fraction: Duration of Bullet's step over that of the component's step.

        Returns:
            Number of vehicles with contact since the last `clear`.
        """
        self.has_contacts = True
        forces: dict[tuple[int, int], float] = {}
        for point in pybullet.getContactPoints(*self._query):  # keyword arguments take longer
            pair = point[_BODY_A:_BODY_END]
            forces[pair] = forces.get(pair, 0.0) + point[_NORMAL_FORCE]
        for pair, force in forces.items():
            if force:
                outputs, flags, velocity_a, velocity_b, vertical_a, vertical_b, limit = (
                    self._pairs.get(pair) or self._find_pair(pair)
                )
                for index in outputs:
                    self._outputs[index] += force * step_fraction
                for index in flags:
                    self._flags[index] = True
                xa, ya, za = _unpack_vector(velocity_a)
                xb, yb, zb = _unpack_vector(velocity_b)
                x, y, z = xa - xb, ya - yb, za * vertical_a - zb * vertical_b
                if (squared_speed := x * x + y * y + z * z) > limit:  # faster than powers
                    self._failures.add_collision(pair, math.sqrt(squared_speed))
        return sum(self._touching)

    def _find_pair(self, pair: tuple[int, int]) -> _Pair:
        vehicles = [
            self._vehicle_indices[body] for body in pair if body in self._vehicle_indices
        ]  # platforms have no outputs
        on_vessels = [
            self._vehicle_indices[a]
            for a, b in (pair, pair[::-1])
            if a in self._vehicle_indices and b in self._vessels
        ]
        flags = [FLAG_COUNT * vehicle + TOUCHING for vehicle in vehicles]
        flags += [FLAG_COUNT * vehicle + ON_VESSEL for vehicle in on_vessels]
        a, b = (self._bodies.get(number) for number in pair)
        self._pairs[pair] = _Pair(
            [self._force_indices[vehicle] for vehicle in vehicles],
            flags,
            a.commanded_twist if a else _NO_MOTION,
            b.commanded_twist if b else _NO_MOTION,
            0.0 if isinstance(a, PlanarBody) else 1.0,
            0.0 if isinstance(b, PlanarBody) else 1.0,
            self._failures.largest_harmless_speed(pair) ** 2,
        )
        return self._pairs[pair]


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
        """Return whether several shapes of a vehicle can touch one other body in the step."""
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
