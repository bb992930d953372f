"""What a vehicle publishes about its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np

from .bullet import pybullet
from .shadow import Shadow

_BODY_A, _BODY_B, _NORMAL_FORCE = 1, 2, 9  # fields of Bullet's contact points


class _Published(NamedTuple):
    """Places of the contact variables of one vehicle."""

    force: int  # in the outputs
    touching: int  # in the flags
    vessel: int


class Contacts:
    """Sums of normal forces, mean over a step of the component, and who touches a vessel.

    `outputs` are those of all vehicles, the force of each comes last; `flags` has a row (touching, vessel) for each vehicle.
    """

    def __init__(self, client: int, shadows: Sequence[Shadow], outputs: np.ndarray, flags: np.ndarray):
        self._client = client
        #: whether anything is published that `clear` would change
        self.any = False
        # memoryviews: setting an element of a numpy array takes twice as long
        self._outputs: Any = outputs.data
        self._flags, self._no_flags = flags.reshape(-1).data, np.zeros(flags.size, flags.dtype).data
        ends = accumulate(len(shadow.outputs) for shadow in shadows)
        places = [_Published(end - 1, 2 * k, 2 * k + 1) for k, end in enumerate(ends)]
        self._published = {shadow.body: place for shadow, place in zip(shadows, places, strict=True)}
        self._vessels = {shadow.body for shadow in shadows if shadow.model.is_vessel}

    def clear(self) -> None:
        """No contact."""
        self.any = False
        self._flags[:] = self._no_flags
        for place in self._published.values():
            self._outputs[place.force] = 0.0

    def add(self, share: float) -> int:
        """Add the contacts of the last step of Bullet, which is this share of the component's step.

        Returns how many vehicles had some.
        """
        self.any = True
        forces: dict[tuple[int, int], float] = {}
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            pair = point[_BODY_A], point[_BODY_B]
            forces[pair] = forces.get(pair, 0.0) + point[_NORMAL_FORCE]
        touching = set()
        for (a, b), force in forces.items():
            if force:
                self._touch(a, b, force * share)
                self._touch(b, a, force * share)
                touching |= {a, b}
        return len(touching & self._published.keys())

    def _touch(self, body: int, other: int, force: float) -> None:
        if body in self._published:  # no platform
            place, touching, vessel = self._published[body]
            self._outputs[place] += force
            self._flags[touching] = True
            if other in self._vessels:
                self._flags[vessel] = True
