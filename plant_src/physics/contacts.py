"""Contact outputs of the vehicles: normal force and flags."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from .body import ContactBody
from .client import pybullet

_BODY_A, _BODY_B, _DISTANCE, _NORMAL_FORCE = 1, 2, 8, 9  # indices in Bullet's contact points


def overlap_depths(client: int) -> dict[tuple[int, int], float]:
    """Return the depth (m) of the deepest contact point of each pair of Bullet bodies in their present poses."""
    pybullet.performCollisionDetection(client)
    depths: dict[tuple[int, int], float] = {}
    for point in pybullet.getContactPoints(physicsClientId=client):
        pair = point[_BODY_A], point[_BODY_B]
        depths[pair] = max(depths.get(pair, 0.0), -point[_DISTANCE])
    return depths


class _ContactOutputs(NamedTuple):
    """Outputs that contact between two bodies changes: indices of forces and of flags."""

    forces: Sequence[int]
    flags: Sequence[int]


class Contacts:
    """Contact outputs: normal force (N), mean over the component's step, and flags.

    Args:
        client: Number of the Bullet client.
        bodies: All vehicles.
        outputs: Real outputs of all vehicles in order; the last one of each vehicle is the contact force.
        flags: Contact with anything, contact with a vessel; shape (vehicles, 2).

    Attributes:
        has_contacts: Whether the outputs may contain contacts that `clear` would remove.
    """

    def __init__(self, client: int, bodies: Sequence[ContactBody], outputs: np.ndarray, flags: np.ndarray):
        self._client = client
        self.has_contacts = False
        # memoryviews: setting an element takes half as long as with NumPy
        self._outputs: Any = outputs.data
        self._flags: Any = flags.reshape(-1).data
        self._no_flags, self._touching = np.zeros(flags.size, flags.dtype).data, flags[:, 0].data
        self._force_ends = list(accumulate(len(body.outputs) for body in bodies))
        self._vehicle_indices = {body.body_id: k for k, body in enumerate(bodies)}
        self._vessels = {body.body_id for body in bodies if body.model.is_vessel}
        self._contact_outputs: dict[tuple[int, int], _ContactOutputs] = {}

    def clear(self) -> None:
        """Set all contact forces to 0 and all flags to false."""
        self.has_contacts = False
        self._flags[:] = self._no_flags
        for end in self._force_ends:
            self._outputs[end - 1] = 0.0

    def add(self, step_fraction: float) -> int:
        """Add the contacts of Bullet's last step to the outputs.

        Args:
            step_fraction: Duration of Bullet's step over that of the component's step.

        Returns:
            Number of vehicles with contact since the last `clear`.
        """
        self.has_contacts = True
        forces: dict[tuple[int, int], float] = {}
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            pair = point[_BODY_A], point[_BODY_B]
            forces[pair] = forces.get(pair, 0.0) + point[_NORMAL_FORCE]
        for pair, force in forces.items():
            if force:
                changed = self._contact_outputs.get(pair) or self._find_outputs(pair)
                for index in changed.forces:
                    self._outputs[index] += force * step_fraction
                for index in changed.flags:
                    self._flags[index] = True
        return sum(self._touching)

    def _find_outputs(self, pair: tuple[int, int]) -> _ContactOutputs:
        vehicles = [self._vehicle_indices[body] for body in pair if body in self._vehicle_indices]  # platforms have no outputs
        on_vessels = [
            self._vehicle_indices[a] for a, b in (pair, pair[::-1]) if a in self._vehicle_indices and b in self._vessels
        ]
        flags = [2 * vehicle for vehicle in vehicles] + [2 * vehicle + 1 for vehicle in on_vessels]
        return self._contact_outputs.setdefault(
            pair, _ContactOutputs([self._force_ends[vehicle] - 1 for vehicle in vehicles], flags)
        )
