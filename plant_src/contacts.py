"""What a vehicle publishes about its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pybullet

from .shadow import Shadow

_BODY_A, _BODY_B, _NORMAL_FORCE = 1, 2, 9  # fields of Bullet's contact points


class _Published(NamedTuple):
    """Where the contact variables of one vehicle lie."""

    outputs: memoryview
    force: int
    flags: memoryview  # touching, vessel


class Contacts:
    """Sums of normal forces, mean over a step of the component, and who touches a vessel.

    `flags` has a row (touching, vessel) for each vehicle.
    """

    def __init__(self, client: int, shadows: Sequence[Shadow], flags: np.ndarray):
        self._client = client
        self._published = {
            shadow.body: _Published(memoryview(shadow.outputs), len(shadow.outputs) - 1, memoryview(row))
            for shadow, row in zip(shadows, flags, strict=True)
        }
        self._vessels = {shadow.body for shadow in shadows if shadow.model.is_vessel}

    def clear(self) -> None:
        """No contact."""
        for outputs, force, flags in self._published.values():
            outputs[force] = 0.0
            flags[0] = flags[1] = False

    def add(self, share: float) -> None:
        """Add the contacts of the last step of Bullet, which is this share of the component's step."""
        for point in pybullet.getContactPoints(physicsClientId=self._client):
            force = point[_NORMAL_FORCE]
            if force > 0:
                self._touch(point[_BODY_A], point[_BODY_B], force * share)
                self._touch(point[_BODY_B], point[_BODY_A], force * share)

    def _touch(self, body: int, other: int, force: float) -> None:
        if body not in self._published:
            return  # a platform
        outputs, place, flags = self._published[body]
        outputs[place] += force
        flags[0] = True
        if other in self._vessels:
            flags[1] = True
