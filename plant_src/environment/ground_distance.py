"""Distance from a multirotor to the surface vertically below it: deck, platform or water."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .sea import Sea

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform

#: height above the still water (m) from which waves are ignored, because they do not affect a rotor
MAX_WAVE_EFFECT_HEIGHT = 5.0


class DeckSurface:
    """The landing deck of a vessel: the top of its highest box, centred at the output `deck.position`."""

    def __init__(self, vessel: ContactBody):
        half_x, half_y, _ = max(vessel.model.body.boxes, key=lambda box: box.position[2] + box.half_extents[2]).half_extents
        self._half_x, self._half_y, self._bounding_radius = half_x, half_y, half_x + half_y
        slots = vessel.model.slots("output")
        self._outputs: Any = vessel.outputs.data
        self._centre, self._orientation = slots.index("deck.position.x"), slots.index("orientation.w")

    def height(self, x: float, y: float) -> float | None:
        """Return the height of the deck (m, world frame) at (x, y), or None beside the deck."""
        c, q, outputs = self._centre, self._orientation, self._outputs
        dx, dy = x - outputs[c], y - outputs[c + 1]
        if abs(dx) > self._bounding_radius or abs(dy) > self._bounding_radius:
            return None
        qw, qx, qy, qz = outputs[q], outputs[q + 1], outputs[q + 2], outputs[q + 3]
        normal_x, normal_y, normal_z = 2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy)
        if normal_z <= 0:
            return None
        dz = -(normal_x * dx + normal_y * dy) / normal_z
        forward = (1 - 2 * (qy * qy + qz * qz)) * dx + 2 * (qx * qy + qw * qz) * dy + 2 * (qx * qz - qw * qy) * dz
        left = 2 * (qx * qy - qw * qz) * dx + (1 - 2 * (qx * qx + qz * qz)) * dy + 2 * (qy * qz + qw * qx) * dz
        inside = abs(forward) <= self._half_x and abs(left) <= self._half_y
        return outputs[c + 2] + dz if inside else None


class GroundDistance:
    """Distances from points to the highest surface vertically below them."""

    def __init__(self, vessels: Sequence[ContactBody], platforms: Sequence[Platform], sea: Sea):
        self._decks = [DeckSurface(vessel) for vessel in vessels]
        self._platforms = [(platform.position, platform.size) for platform in platforms]
        self._elevation = sea.elevation_function() if len(sea.amplitude) else None

    def distance(self, x: float, y: float, z: float, time: float, wave_gain: float) -> float:
        """Return the distance (m) below a point, 0 under water.

        Args:
            x: East position (m, world frame).
            y: North position (m, world frame).
            z: Height (m, world frame).
            time: Time of the waves (s).
            wave_gain: Factor on all amplitudes (1).
        """
        solid = self._solid_height(x, y, z)
        if solid > -math.inf:  # decks and platforms hide the water
            return z - solid
        surface = wave_gain * self._elevation(x, y, time) if z < MAX_WAVE_EFFECT_HEIGHT and self._elevation else 0.0
        return max(z - surface, 0.0)

    def _solid_height(self, x: float, y: float, z: float) -> float:
        """Return the height (m) of the highest deck or platform at (x, y) that is not above z, or -inf."""
        highest = -math.inf
        for deck in self._decks:
            height = deck.height(x, y)
            if height is not None and highest < height <= z:
                highest = height
        for (px, py, pz), (ex, ey, ez) in self._platforms:
            if highest < pz + ez / 2 <= z and abs(x - px) <= ex / 2 and abs(y - py) <= ey / 2:
                highest = pz + ez / 2
        return highest
