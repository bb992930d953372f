"""Contact outputs and failures of the vehicles, and contact points that Bullet must forget.

Bullet keeps contact points from one step to the next, and starts its solution with their last
impulses. Its saved states hold the points of one pair of shapes for each pair of bodies. While
several shapes of a vehicle can touch one other body, for example both hulls a wall, Bullet
therefore computes all points afresh in each step, from poses and velocities alone. So saved states
are restored bit for bit.

A vehicle of one shape on a vehicle of several shapes, for example a multirotor on a deck, does not
cause this.
"""

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from ..placement import VehiclePlacement
from ..vehicles.common.interface import MAY_FAIL
from .body import ContactBody, PlanarBody
from .bullet import pybullet
from .clearance import NEAR_DISTANCE, BoundingBox

#: indices of the flags of a vehicle, in the order of its Boolean variables
TOUCHING, ON_VESSEL, CRASHED, DITCHED = range(4)
FLAG_COUNT = 4

_unpack_pose = struct.Struct("7d").unpack_from

#: function from x and y (m) to the height of the water surface there (m)
WaterLevel = Callable[[float, float], float]


class Failures:
    """Failures of all vehicles, which stay true: crashed and ditched.

    A collision is a crash if it can change the velocity of the vehicle by more than its crash
    speed. The change is that of a perfectly inelastic collision of the two centres of mass: the
    relative velocity before the step, times the mass of the other body over the mass of both. At a
    platform it is the whole velocity. A vehicle that slides over a platform at speed has crashed,
    too. A multirotor that touches something upside down, and a vessel that is upside down, have
    crashed. A multirotor is ditched if its centre of mass is below the water and no vessel carries
    it.

    Args:
        bodies: Contact body of each vehicle.
        vehicles: Settings of each vehicle.
        flags: All flags, shape (vehicles, FLAG_COUNT).
        step_status: Status of the last step of each vehicle.
        platform_names: Name of each platform by its number in Bullet.

    Attributes:
        alarm: Whether `examine` must be called after the step.
        permanent_flags: Flags of the failures alone, in the order of `flags`.
    """

    def __init__(
        self,
        bodies: Sequence[ContactBody],
        vehicles: Sequence[VehiclePlacement],
        flags: np.ndarray,
        step_status: np.ndarray,
        platform_names: Mapping[int, str],
    ):
        self._bodies, self._flags = bodies, flags
        # memoryviews: access to a few numbers is faster than with NumPy
        self._step_status: Any = step_status.data
        self._flag_data: Any = flags.reshape(-1).data
        self._outputs: list[Any] = [body.outputs.data for body in bodies]
        self.permanent_flags = np.zeros_like(flags)
        self.alarm = False
        self._names = {**platform_names, **{body.body_id: body.name for body in bodies}}
        self._indices = {body.body_id: k for k, body in enumerate(bodies)}
        self._masses = {
            body.body_id: vehicle.body.mass for body, vehicle in zip(bodies, vehicles, strict=True)
        }
        self._crash_speeds = [vehicle.crash_speed for vehicle in vehicles]
        self._messages: list[str] = []

    def largest_harmless_speed(self, pair: tuple[int, int]) -> float:
        """Return the relative speed (m/s) above which one of two colliding bodies has crashed."""
        limits = [
            self._crash_speeds[self._indices[body]] / share
            for body, share in self._shares(pair)
            if body in self._indices
        ]
        return min(limits)

    def _shares(self, pair: tuple[int, int]) -> list[tuple[int, float]]:
        """Return the shares of the relative velocity that a collision takes from two bodies."""
        a, b = (self._masses.get(body, math.inf) for body in pair)
        share = b / (a + b) if math.isfinite(a) else 0.0
        if math.isinf(b):
            share = 1.0
        return [(pair[0], share), (pair[1], 1 - share)]

    def add_collision(self, pair: tuple[int, int], speed: float) -> None:
        """Record the crashes in a collision of two bodies with a relative speed (m/s)."""
        for (body, share), (other, _) in zip(
            self._shares(pair), self._shares(pair)[::-1], strict=True
        ):
            vehicle = self._indices.get(body)
            if vehicle is not None and share * speed > self._crash_speeds[vehicle]:
                text = (
                    f"collision with {self._names[other]} at {speed:.2f} m/s, limit "
                    f"{self._crash_speeds[vehicle] / share:.2f} m/s"
                )
                self._record(vehicle, CRASHED, text)

    def _record(self, vehicle: int, failure: int, text: str) -> None:
        if not self.permanent_flags[vehicle, failure]:
            self.permanent_flags[vehicle, failure] = self._flags[vehicle, failure] = True
            self._messages.append(
                f"{self._bodies[vehicle].name} {'crashed' if failure == CRASHED else 'ditched'}: "
                f"{text}"
            )
            self.alarm = True

    def examine(self, water_level: WaterLevel) -> list[str]:
        """Find ditched and capsized vehicles; return a message per failure since the last call."""
        for vehicle, status in enumerate(self._step_status):
            if status >= MAY_FAIL:
                self._examine(vehicle, water_level)
        messages, self._messages, self.alarm = self._messages, [], False
        return messages

    def _examine(self, vehicle: int, water_level: WaterLevel) -> None:
        is_touching, is_on_vessel, _, is_ditched = self._flag_data[
            FLAG_COUNT * vehicle : FLAG_COUNT * (vehicle + 1)
        ]
        x, y, z, _, qx, qy, _ = _unpack_pose(self._outputs[vehicle])
        is_vessel = self._bodies[vehicle].model.is_vessel
        if qx * qx + qy * qy > 0.5 and (is_vessel or is_touching):
            self._record(vehicle, CRASHED, "capsized" if is_vessel else "upside down in contact")
        if not (is_vessel or is_on_vessel or is_ditched) and z < (level := water_level(x, y)):
            self._record(vehicle, DITCHED, f"{level - z:.2f} m below the water")

    def restore(self, flags: np.ndarray) -> None:
        """Restore the failures from all flags of a saved state."""
        self.permanent_flags[:, CRASHED:] = flags[:, CRASHED:]
        self._messages, self.alarm = [], False


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
        flags: Flags of each vehicle (`Failures`), shape (vehicles, FLAG_COUNT).
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
        # Points are summed for each pair of bodies. The speed of a collision is the difference of
        # the velocities before Bullet's step; that of a planar vessel along z only holds it up.
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
