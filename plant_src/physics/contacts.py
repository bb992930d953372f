"""What a vehicle publishes about its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from .body import ContactBody
from .client import pybullet

_BODY_A, _BODY_B, _NORMAL_FORCE = 1, 2, 9  # fields of Bullet's contact points


class _ContactTargets(NamedTuple):
    """What contact between two bodies changes: forces in the outputs, and flags."""

    forces: Sequence[int]
    flags: Sequence[int]


class Contacts:
    """Sums of normal forces, mean over a step of the component, and who touches a vessel.

    `outputs` are those of all vehicles, the force of each comes last; `flags` has a row (touching, vessel) for each vehicle.
    """

    def __init__(self, client: int, shadows: Sequence[ContactBody], outputs: np.ndarray, flags: np.ndarray):
        self._client = client
        #: whether anything is published that `clear` would change
        self.has_contacts = False
        # memoryviews: setting an element of a numpy array takes twice as long
        self._outputs: Any = outputs.data
        self._flags: Any = flags.reshape(-1).data
        self._no_flags, self._touching = np.zeros(flags.size, flags.dtype).data, flags[:, 0].data
        self._force_ends = list(accumulate(len(shadow.outputs) for shadow in shadows))
        self._vehicle_indices = {shadow.body_id: k for k, shadow in enumerate(shadows)}
        self._vessels = {shadow.body_id for shadow in shadows if shadow.model.is_vessel}
        self._targets: dict[tuple[int, int], _ContactTargets] = {}

    def clear(self) -> None:
        """No contact."""
        self.has_contacts = False
        self._flags[:] = self._no_flags
        for end in self._force_ends:
            self._outputs[end - 1] = 0.0

    def add(self, step_fraction: float) -> int:
        """Add the contacts of the last step of Bullet, which is this share of the component's step.

        Returns how many vehicles have had some since `clear`.
        """
        self.has_contacts = True
        forces: dict[tuple[int, int], float] = {}
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            bodies = point[_BODY_A], point[_BODY_B]
            forces[bodies] = forces.get(bodies, 0.0) + point[_NORMAL_FORCE]
        for bodies, force in forces.items():
            if force:
                pair = self._targets.get(bodies) or self._find_targets(bodies)
                for place in pair.forces:
                    self._outputs[place] += force * step_fraction
                for place in pair.flags:
                    self._flags[place] = True
        return sum(self._touching)

    def _find_targets(self, bodies: tuple[int, int]) -> _ContactTargets:
        numbers = [self._vehicle_indices[body] for body in bodies if body in self._vehicle_indices]  # platforms publish nothing
        on_vessels = [
            self._vehicle_indices[a] for a, b in (bodies, bodies[::-1]) if a in self._vehicle_indices and b in self._vessels
        ]
        flags = [2 * number for number in numbers] + [2 * number + 1 for number in on_vessels]
        return self._targets.setdefault(bodies, _ContactTargets([self._force_ends[number] - 1 for number in numbers], flags))
