"""What a vehicle publishes about its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .bullet import pybullet
from .shadow import Shadow

_BODY_A, _BODY_B, _NORMAL_FORCE = 1, 2, 9  # fields of Bullet's contact points


class _Published(NamedTuple):
    """Where the contact variables of one vehicle lie."""

    outputs: Any  # memoryviews: setting an element of a numpy array takes twice as long
    force: int
    flags: Any  # touching, vessel


class Contacts:
    """Sums of normal forces, mean over a step of the component, and who touches a vessel.

    `flags` has a row (touching, vessel) for each vehicle.
    """

    def __init__(self, client: int, shadows: Sequence[Shadow], flags: np.ndarray):
        self._client = client
        #: whether anything is published that `clear` would change
        self.any = False
        self._published = {
            shadow.body: _Published(shadow.outputs.data, len(shadow.outputs) - 1, row.data)
            for shadow, row in zip(shadows, flags, strict=True)
        }
        self._vessels = {shadow.body for shadow in shadows if shadow.model.is_vessel}

    def clear(self) -> None:
        """No contact."""
        self.any = False
        for outputs, force, flags in self._published.values():
            outputs[force] = 0.0
            flags[0] = flags[1] = False

    def add(self, share: float) -> None:
        """Add the contacts of the last step of Bullet, which is this share of the component's step."""
        self.any = True
        forces: dict[tuple[int, int], float] = {}
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            if (force := point[_NORMAL_FORCE]) > 0:
                pair = point[_BODY_A], point[_BODY_B]
                forces[pair] = forces.get(pair, 0.0) + force
        for (a, b), force in forces.items():
            self._touch(a, b, force * share)
            self._touch(b, a, force * share)

    def _touch(self, body: int, other: int, force: float) -> None:
        if body not in self._published:
            return  # a platform
        outputs, place, flags = self._published[body]
        outputs[place] += force
        flags[0] = True
        if other in self._vessels:
            flags[1] = True
