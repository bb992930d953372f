"""Fleet: all vehicles of a world, advanced together by one step.

Their arrays lie in one buffer, so that one copy saves their state.
"""

import math
import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..placement import VehiclePlacement
from ..vehicles.common.interface import INVALID_STATE, LEAVES_SAFE_BOX, MAY_FAIL
from .body import ContactBody, InvalidStateError, PlanarBody, body_class, state_sizes
from .bullet import pybullet
from .clearance import BoundingBox, Clearance
from .compiled_equations import CompiledEquations
from .contacts import ContactMemory, Contacts, Failures, touching_pairs


class VehicleArrays:
    """Named arrays of all vehicles.

    Those with the same name lie side by side, in the order of the vehicles.

    Args:
        sizes: For each vehicle its arrays, as name to size.

    Attributes:
        buffer: All numbers; the other arrays are views of it.
        of_all_vehicles: For each name the numbers of all vehicles.
        of_vehicle: For each vehicle its arrays by name.
    """

    def __init__(self, sizes: Sequence[Mapping[str, int]]):
        totals = Counter[str]()
        for own in sizes:
            totals.update(own)
        self.buffer = np.zeros(totals.total())
        self.of_all_vehicles: dict[str, np.ndarray] = {}
        self.of_vehicle: list[dict[str, np.ndarray]] = [{} for _ in sizes]
        first = 0
        for name, total in totals.items():
            self.of_all_vehicles[name] = self.buffer[first : first + total]
            for own, arrays in zip(sizes, self.of_vehicle, strict=True):
                if name in own:
                    arrays[name] = self.buffer[first : first + own[name]]
                    first += own[name]


#: limit of the repetitions of a Bullet step that keep planar vessels at their height
MAX_REPEATS = 10

_unpack_vector = struct.Struct("3d").unpack_from
_ANGULAR_OFFSET = struct.calcsize("3d")  # of the angular velocity in a twist, in bytes
_pack_twist = struct.Struct("6d").pack_into


@dataclass(frozen=True)
class FleetState:
    """Saved state of a fleet.

    Attributes:
        bullet: Number of the state that Bullet holds.
        memory: Copy of the arrays of all vehicles.
        flags: Copy of the flags.
        is_near: For each vehicle whether Bullet steps its body.
        touching_pairs: Pairs of bodies between which Bullet keeps contact points.
    """

    bullet: int
    memory: np.ndarray
    flags: np.ndarray
    is_near: Sequence[bool]
    touching_pairs: frozenset[tuple[int, int]]


class Fleet:
    """Vehicles that move by their own equations, with contact resolved by Bullet.

    Args:
        client: Number of the Bullet client.
        vehicles: Vehicles to create.
        fixed: Bounding boxes of platforms and obstacles, which exist in Bullet already.
        step_size: Duration of a step (s), shape (1,); the owner may change it between steps.
        flags: Flags of each vehicle (`contacts.Failures`), shape (vehicles, FLAG_COUNT).
        fixed_names: Name of each platform and obstacle by its number in Bullet.

    Attributes:
        bodies: Contact body of each vehicle.
        inputs: Real inputs of all vehicles in order.
        outputs: Real outputs of all vehicles in order.
        contacts: Contact outputs.
        failures: Crashed and ditched vehicles.
        clearance: Detection of near vehicles.
    """

    def __init__(
        self,
        client: int,
        vehicles: Sequence[VehiclePlacement],
        fixed: Sequence[BoundingBox],
        step_size: np.ndarray,
        flags: np.ndarray,
        fixed_names: Mapping[int, str],
    ):
        self._client, self._flags = client, flags
        equations = [CompiledEquations(vehicle.model) for vehicle in vehicles]
        self._memory = memory = VehicleArrays(
            [
                state_sizes(vehicle.model, own)
                for vehicle, own in zip(vehicles, equations, strict=True)
            ]
        )
        self.bodies: list[ContactBody] = [
            body_class(vehicle.model)(client, vehicle, own, {**arrays, "step_size": step_size})
            for vehicle, own, arrays in zip(vehicles, equations, memory.of_vehicle, strict=True)
        ]
        self.inputs, self.outputs = (
            memory.of_all_vehicles["inputs"],
            memory.of_all_vehicles["outputs"],
        )
        self.failures = Failures(
            self.bodies, vehicles, flags, memory.of_all_vehicles["step_status"], fixed_names
        )
        self.contacts = Contacts(client, self.bodies, self.outputs, flags, self.failures)
        self._contact_memory = ContactMemory(client, self.bodies, vehicles, fixed)
        movable = [
            body.bounding_box(vehicle.body)
            for body, vehicle in zip(self.bodies, vehicles, strict=True)
        ]
        distances = (
            memory.of_all_vehicles[name]
            for name in ("endpoints", "reference_position", "safe_distance")
        )
        self.clearance = Clearance(movable, fixed, *distances)
        self._predict, self._correct = (
            [body.predict for body in self.bodies],
            [body.correct for body in self.bodies],
        )
        # memoryviews: access to a few numbers is faster than with NumPy
        self._step_status: Any = memory.of_all_vehicles["step_status"].data
        self._impulse_magnitudes: Any = memory.of_all_vehicles["impulse_magnitude"].data
        #: whether a vehicle without contact may have moved away from what it was near
        self._near_vehicles_outdated = True
        # Bullet applies a changed inertia only from the next step on: one step without contact
        for active in (False, True):
            for body in self.bodies:
                body.set_active(active)
            if not active:
                pybullet.stepSimulation(client)
        self._set_active_bodies([True] * len(self.bodies))

    def advance(self, step_fraction: float) -> None:
        """Advance all vehicles by one step.

        Args:
            step_fraction: Duration of the step over that of the component's step.

        Raises:
            InvalidStateError: If an input or a state is not finite or too large. If `predict` finds
                it, nothing has moved.
        """
        for predict in self._predict:
            predict()
        if self._near_vehicles_outdated or any(self._step_status):
            self._handle_step_status()
        if self._active_bodies:
            if self._contact_memory.watched_pairs and self._contact_memory.is_unsafe():
                self._remove_contact_points()
                for body in self._active_bodies:
                    body.reset_pose()
            self._solve_contacts()
        for correct in self._correct:
            correct()
        if self._active_bodies:
            self._publish_contacts(step_fraction)

    def _handle_step_status(self) -> None:
        """Refuse an invalid state, report possible failures, find near vehicles if necessary."""
        statuses = self._step_status.tolist()
        if INVALID_STATE in statuses:
            raise InvalidStateError(
                self.bodies[statuses.index(INVALID_STATE)].describe_invalid_state()
            )
        if max(statuses) >= MAY_FAIL:
            self.failures.alarm = True
        leaves_safe_box = LEAVES_SAFE_BOX in statuses or LEAVES_SAFE_BOX + MAY_FAIL in statuses
        if leaves_safe_box or (self._near_vehicles_outdated and not self.clearance.is_valid()):
            self._update_near_vehicles()
        self._near_vehicles_outdated = False

    def _update_near_vehicles(self) -> None:
        """Activate the bodies of vehicles that are near something; deactivate the others."""
        near = self.clearance.find_near_vehicles()
        self._contact_memory.watch(self.clearance.near_pairs or ())
        if near != self._is_near:
            for body, is_near, was_near in zip(self.bodies, near, self._is_near, strict=True):
                if is_near != was_near:
                    body.set_active(is_near)
            self._set_active_bodies(near)

    def _set_active_bodies(self, near: Sequence[bool]) -> None:
        """Prepare Bullet steps with these bodies."""
        self._is_near = near
        self._active_bodies = active = [
            body for body, is_near in zip(self.bodies, near, strict=True) if is_near
        ]
        self._velocity_commands = [
            (body.body_id, body.commanded_twist, body.compensating_torque) for body in active
        ]
        self._velocity_results = [(body.body_id, body.bullet_twist) for body in active]
        self._active_planar_bodies = [body for body in active if isinstance(body, PlanarBody)]

    def _solve_contacts(self) -> None:
        """Make one Bullet step, and repeat it until planar vessels keep their height."""
        for vessel in self._active_planar_bodies:
            vessel.reset_height()
        self._step_bullet()
        for repeats in range(MAX_REPEATS):
            converged = True
            for vessel in self._active_planar_bodies:
                converged &= vessel.height_converged(repeats)
            if converged:
                return
            for body in self._active_bodies:
                body.reset_pose()
            self._step_bullet()

    def _step_bullet(self) -> None:
        client = self._client
        for body, twist, torque in self._velocity_commands:
            pybullet.resetBaseVelocity(
                body, _unpack_vector(twist), _unpack_vector(twist, _ANGULAR_OFFSET), client
            )
            if torque is not None:
                pybullet.applyExternalTorque(
                    body, -1, _unpack_vector(torque), pybullet.WORLD_FRAME, client
                )
        pybullet.stepSimulation(client)
        for body, twist in self._velocity_results:
            linear, angular = pybullet.getBaseVelocity(body, client)
            _pack_twist(twist, 0, *linear, *angular)

    def _publish_contacts(self, step_fraction: float) -> None:
        touching = 0
        if total := sum(self._impulse_magnitudes):
            if total != total:  # faster than `math.isnan`
                magnitudes = zip(self.bodies, self._impulse_magnitudes, strict=True)
                invalid = next(body for body, magnitude in magnitudes if math.isnan(magnitude))
                raise InvalidStateError(f"{invalid.name}: the contact forces are not finite")
            touching = self.contacts.add(step_fraction)
        self._near_vehicles_outdated = touching < len(self._active_bodies)

    def get_state(self) -> FleetState:
        """Return a copy of the state, which also takes memory in Bullet until `free_state`."""
        pairs = touching_pairs(self._client)
        return FleetState(
            pybullet.saveState(self._client),
            self._memory.buffer.copy(),
            self._flags.copy(),
            self._is_near,
            pairs,
        )

    def set_state(self, state: FleetState) -> None:
        """Restore a state."""
        # Bullet keeps the points of a pair that has none in the state
        if not touching_pairs(self._client) <= state.touching_pairs:
            self._remove_contact_points()
        pybullet.restoreState(state.bullet, physicsClientId=self._client)
        self._memory.buffer[:], self._flags[:] = state.memory, state.flags
        self.failures.restore(state.flags)
        self._set_active_bodies(state.is_near)
        self.clearance.invalidate()
        self._near_vehicles_outdated = True
        self.contacts.has_contacts = bool(state.flags.any())

    def _remove_contact_points(self) -> None:
        """Move all vehicles apart, so that Bullet has no contact points."""
        for body in self._active_bodies:
            body.set_active(False)
        pybullet.performCollisionDetection(self._client)

    def free_state(self, state: FleetState) -> None:
        """Release the memory of a state in Bullet."""
        pybullet.removeState(state.bullet, physicsClientId=self._client)
