"""The vehicles of a world: one step of all of them together."""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..placement import Platform, Spawn
from ..vehicles.common.alarms import UNSOUND
from .body import PlanarBody, Shadow, UnsoundError, body_class
from .clearance import Clearance, Enclosure
from .client import pybullet
from .contacts import Contacts
from .memory import Memory

#: so often a step of Bullet is made again at most
MOST_REPEATS = 10

_vector = struct.Struct("3d").unpack_from
_ANGULAR = struct.calcsize("3d")  # where the angular part of a motion begins
_write_motion = struct.Struct("6d").pack_into


@dataclass(frozen=True)
class Snapshot:
    """The state of a fleet: Bullet's, which Bullet keeps under a number, and ours."""

    bullet: int
    memory: np.ndarray
    flags: np.ndarray
    near: Sequence[bool]


class Fleet:
    """Vehicles that move by their own equations, and meet each other and the platforms in Bullet.

    `step` holds the length of a step (s); `flags` has a row (touching, vessel) for each vehicle. `inputs` and `outputs` are
    the real variables of all vehicles, in order.
    """

    def __init__(
        self, client: int, vehicles: Sequence[Spawn], platforms: Sequence[Platform], step: np.ndarray, flags: np.ndarray
    ):
        self._client, self._flags = client, flags
        self._memory = memory = Memory([body_class(spawn.model).sizes(spawn.model) for spawn in vehicles])
        self.shadows: list[Shadow] = [
            body_class(spawn.model)(client, spawn, pieces | {"step": step})
            for spawn, pieces in zip(vehicles, memory.parts, strict=True)
        ]
        self.inputs, self.outputs = memory.whole["inputs"], memory.whole["outputs"]
        self.contacts = Contacts(client, self.shadows, self.outputs, flags)
        movable = [shadow.enclosure(spawn.body) for shadow, spawn in zip(self.shadows, vehicles, strict=True)]
        fixed = [_enclosure(platform) for platform in platforms]
        self.clearance = Clearance(movable, fixed, *(memory.whole[name] for name in ("path", "anchor", "leash")))
        self._predict, self._correct = [shadow.predict for shadow in self.shadows], [shadow.correct for shadow in self.shadows]
        # memoryviews: numpy takes longer for so few numbers
        self._alarms: Any = memory.whole["alarm"].data
        self._impulses: Any = memory.whole["impulse"].data
        #: whether a vehicle may have left what it was near
        self._leaving = True
        self._let_bullet_take_note()
        self._choose([True] * len(self.shadows))

    def _let_bullet_take_note(self) -> None:
        """A step in which nothing can meet: with the next one Bullet uses the inertia that it was given."""
        for engaged in (False, True):
            for shadow in self.shadows:
                shadow.engage(engaged)
            if not engaged:
                pybullet.stepSimulation(self._client)

    def advance(self, share: float) -> None:
        """One step, which is this share of the component's. Raises UnsoundError; if before the step, nothing has moved."""
        for predict in self._predict:
            predict()
        if self._leaving or any(self._alarms):
            self._look_around()
        if self._engaged:
            self._collide()
        for correct in self._correct:
            correct()
        if self._engaged:
            self._find_contacts(share)

    def _look_around(self) -> None:
        """Let Bullet take part for those that are near something."""
        if UNSOUND in self._alarms:
            raise UnsoundError(self.shadows[self._alarms.tolist().index(UNSOUND)].fault())
        self._leaving = False
        if not any(self._alarms) and self.clearance.holds():
            return
        near = self.clearance.survey()
        if near != self._near:
            for shadow, is_near, was_near in zip(self.shadows, near, self._near, strict=True):
                if is_near != was_near:
                    shadow.engage(is_near)
            self._choose(near)

    def _choose(self, near: Sequence[bool]) -> None:
        """Make steps of Bullet ready, in which these vehicles take part."""
        self._near = near
        self._engaged = engaged = [shadow for shadow, is_near in zip(self.shadows, near, strict=True) if is_near]
        self._told = [(shadow.body, shadow.twist, shadow.torque) for shadow in engaged]
        self._asked = [(shadow.body, shadow.motion) for shadow in engaged]
        self._planar = [shadow for shadow in engaged if isinstance(shadow, PlanarBody)]

    def _collide(self) -> None:
        """One step of Bullet."""
        for vessel in self._planar:
            vessel.keep_height()
        self._step_bullet()
        for repeats in range(MOST_REPEATS):
            if all([vessel.held(repeats) for vessel in self._planar]):
                return
            for shadow in self._engaged:
                shadow.go_back()
            self._step_bullet()

    def _step_bullet(self) -> None:
        client = self._client
        for body, twist, torque in self._told:
            pybullet.resetBaseVelocity(body, _vector(twist), _vector(twist, _ANGULAR), client)
            if torque is not None:
                pybullet.applyExternalTorque(body, -1, _vector(torque), pybullet.WORLD_FRAME, client)
        pybullet.stepSimulation(client)
        for body, motion in self._asked:
            linear, angular = pybullet.getBaseVelocity(body, client)
            _write_motion(motion, 0, *linear, *angular)

    def _find_contacts(self, share: float) -> None:
        touching = 0
        if total := sum(self._impulses):
            if math.isnan(total):
                culprit = next(shadow for shadow, value in zip(self.shadows, self._impulses, strict=True) if math.isnan(value))
                raise UnsoundError(f"{culprit.name}: the contact forces are not finite")
            touching = self.contacts.add(share)
        self._leaving = touching < len(self._engaged)

    # -- state ---------------------------------------------------------------------------------------------------------

    def get_state(self) -> Snapshot:
        return Snapshot(pybullet.saveState(self._client), self._memory.block.copy(), self._flags.copy(), self._near)

    def set_state(self, state: Snapshot) -> None:
        pybullet.restoreState(state.bullet, physicsClientId=self._client)
        self._memory.block[:], self._flags[:] = state.memory, state.flags
        self._choose(state.near)
        self.clearance.forget()
        self._leaving = True
        self.contacts.any = bool(state.flags.any())

    def free_state(self, state: Snapshot) -> None:
        pybullet.removeState(state.bullet, physicsClientId=self._client)


def _enclosure(platform: Platform) -> Enclosure:
    x, y, z = platform.position
    half_x, half_y, half_z = (edge / 2 for edge in platform.size)
    return Enclosure((x - half_x, y - half_y, z - half_z), (x + half_x, y + half_y, z + half_z))
