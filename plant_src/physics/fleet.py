"""The vehicles of a world: one step of all of them together."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..placement import Platform, VehiclePlacement
from ..vehicles.common.alarms import INVALID_STATE
from .body import ContactBody, InvalidStateError, PlanarBody, body_class
from .clearance import BoundingBox, Clearance
from .client import pybullet
from .contacts import Contacts
from .vehicle_arrays import VehicleArrays

#: so often a step of Bullet is made again at most
MAX_REPEATS = 10

_unpack_vector = struct.Struct("3d").unpack_from
_ANGULAR_OFFSET = struct.calcsize("3d")  # where the angular part of a motion begins
_pack_twist = struct.Struct("6d").pack_into


@dataclass(frozen=True)
class FleetState:
    """The state of a fleet: Bullet's, which Bullet keeps under a number, and ours."""

    bullet: int
    memory: np.ndarray
    flags: np.ndarray
    is_near: Sequence[bool]


class Fleet:
    """Vehicles that move by their own equations, and meet each other and the platforms in Bullet.

    `step` holds the length of a step (s); `flags` has a row (touching, vessel) for each vehicle. `inputs` and `outputs` are
    the real variables of all vehicles, in order.
    """

    def __init__(
        self,
        client: int,
        vehicles: Sequence[VehiclePlacement],
        platforms: Sequence[Platform],
        step: np.ndarray,
        flags: np.ndarray,
    ):
        self._client, self._flags = client, flags
        self._memory = memory = VehicleArrays([body_class(spawn.model).array_sizes(spawn.model) for spawn in vehicles])
        self.bodies: list[ContactBody] = [
            body_class(spawn.model)(client, spawn, pieces | {"step": step})
            for spawn, pieces in zip(vehicles, memory.of_vehicle, strict=True)
        ]
        self.inputs, self.outputs = memory.of_all_vehicles["inputs"], memory.of_all_vehicles["outputs"]
        self.contacts = Contacts(client, self.bodies, self.outputs, flags)
        movable = [shadow.bounding_box(spawn.body) for shadow, spawn in zip(self.bodies, vehicles, strict=True)]
        fixed = [_platform_bounding_box(platform) for platform in platforms]
        self.clearance = Clearance(movable, fixed, *(memory.of_all_vehicles[name] for name in ("path", "anchor", "leash")))
        self._predict, self._correct = [shadow.predict for shadow in self.bodies], [shadow.correct for shadow in self.bodies]
        # memoryviews: numpy takes longer for so few numbers
        self._alarms: Any = memory.of_all_vehicles["alarm"].data
        self._impulses: Any = memory.of_all_vehicles["impulse"].data
        #: whether a vehicle may have left what it was near
        self._near_vehicles_outdated = True
        self._warm_up_inertia()
        self._set_active_bodies([True] * len(self.bodies))

    def _warm_up_inertia(self) -> None:
        """A step in which nothing can meet: with the next one Bullet uses the inertia that it was given."""
        for engaged in (False, True):
            for shadow in self.bodies:
                shadow.set_active(engaged)
            if not engaged:
                pybullet.stepSimulation(self._client)

    def advance(self, step_fraction: float) -> None:
        """One step, which is this share of the component's. Raises UnsoundError; if before the step, nothing has moved."""
        for predict in self._predict:
            predict()
        if self._near_vehicles_outdated or any(self._alarms):
            self._update_near_vehicles()
        if self._active_bodies:
            self._solve_contacts()
        for correct in self._correct:
            correct()
        if self._active_bodies:
            self._publish_contacts(step_fraction)

    def _update_near_vehicles(self) -> None:
        """Let Bullet take part for those that are near something."""
        if INVALID_STATE in self._alarms:
            raise InvalidStateError(self.bodies[self._alarms.tolist().index(INVALID_STATE)].describe_invalid_state())
        self._near_vehicles_outdated = False
        if not any(self._alarms) and self.clearance.is_valid():
            return
        near = self.clearance.find_near_vehicles()
        if near != self._is_near:
            for shadow, is_near, was_near in zip(self.bodies, near, self._is_near, strict=True):
                if is_near != was_near:
                    shadow.set_active(is_near)
            self._set_active_bodies(near)

    def _set_active_bodies(self, near: Sequence[bool]) -> None:
        """Make steps of Bullet ready, in which these vehicles take part."""
        self._is_near = near
        self._active_bodies = engaged = [shadow for shadow, is_near in zip(self.bodies, near, strict=True) if is_near]
        self._velocity_commands = [(shadow.body_id, shadow.twist, shadow.torque) for shadow in engaged]
        self._velocity_results = [(shadow.body_id, shadow.bullet_twist) for shadow in engaged]
        self._active_planar_bodies = [shadow for shadow in engaged if isinstance(shadow, PlanarBody)]

    def _solve_contacts(self) -> None:
        """One step of Bullet."""
        for vessel in self._active_planar_bodies:
            vessel.reset_height()
        self._step_bullet()
        for repeats in range(MAX_REPEATS):
            if all([vessel.height_converged(repeats) for vessel in self._active_planar_bodies]):
                return
            for shadow in self._active_bodies:
                shadow.reset_pose()
            self._step_bullet()

    def _step_bullet(self) -> None:
        client = self._client
        for body, twist, torque in self._velocity_commands:
            pybullet.resetBaseVelocity(body, _unpack_vector(twist), _unpack_vector(twist, _ANGULAR_OFFSET), client)
            if torque is not None:
                pybullet.applyExternalTorque(body, -1, _unpack_vector(torque), pybullet.WORLD_FRAME, client)
        pybullet.stepSimulation(client)
        for body, motion in self._velocity_results:
            linear, angular = pybullet.getBaseVelocity(body, client)
            _pack_twist(motion, 0, *linear, *angular)

    def _publish_contacts(self, share: float) -> None:
        touching = 0
        if total := sum(self._impulses):
            if math.isnan(total):
                culprit = next(shadow for shadow, value in zip(self.bodies, self._impulses, strict=True) if math.isnan(value))
                raise InvalidStateError(f"{culprit.name}: the contact forces are not finite")
            touching = self.contacts.add(share)
        self._near_vehicles_outdated = touching < len(self._active_bodies)

    # -- state ---------------------------------------------------------------------------------------------------------

    def get_state(self) -> FleetState:
        return FleetState(pybullet.saveState(self._client), self._memory.buffer.copy(), self._flags.copy(), self._is_near)

    def set_state(self, state: FleetState) -> None:
        pybullet.restoreState(state.bullet, physicsClientId=self._client)
        self._memory.buffer[:], self._flags[:] = state.memory, state.flags
        self._set_active_bodies(state.is_near)
        self.clearance.invalidate()
        self._near_vehicles_outdated = True
        self.contacts.has_contacts = bool(state.flags.any())

    def free_state(self, state: FleetState) -> None:
        pybullet.removeState(state.bullet, physicsClientId=self._client)


def _platform_bounding_box(platform: Platform) -> BoundingBox:
    x, y, z = platform.position
    half_x, half_y, half_z = (edge / 2 for edge in platform.size)
    return BoundingBox((x - half_x, y - half_y, z - half_z), (x + half_x, y + half_y, z + half_z))
