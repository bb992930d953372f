"""Distance from a multirotor to the surface vertically below it: deck, platform or water; and its share of the rotors' area.

The area is that of a disc around the centre of the rotors. An edge at the distance d from the centre leaves the share
1/2 + (c sqrt(1 - c^2) + asin c) / pi of a disc of the radius R, with c = d / R limited to -1 ... 1. The share of a strip is the
sum of those of its edges minus 1. The share of a rectangle is the product of those of its two strips, which is exact beside one
edge.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from .sea import Sea

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform

#: height above the still water (m) from which waves are ignored, because they do not affect a rotor
MAX_WAVE_EFFECT_HEIGHT = 5.0


#: a surface below a point: its height (m, world frame) and its share of the disc around the point (1)
Surface = tuple[float, float]

_unpack_vector, _unpack_quaternion = struct.Struct("3d").unpack_from, struct.Struct("4d").unpack_from


class DeckSurface:
    """The landing deck of a vessel: the top of its highest box, centred at the output `deck.position`."""

    def __init__(self, vessel: ContactBody):
        half_x, half_y, _ = max(vessel.model.body.boxes, key=lambda box: box.position[2] + box.half_extents[2]).half_extents
        self._half_x, self._half_y, self._bounding_radius = half_x, half_y, half_x + half_y
        slots = vessel.model.slots("output")
        self._centre: Any = vessel.outputs[slots.index("deck.position.x") :].data
        self._orientation: Any = vessel.outputs[slots.index("orientation.w") :].data

    def below(self, x: float, y: float, radius: float) -> Surface | None:
        """Return the plane of the deck at (x, y), or None if a disc of this radius (m) is beside the deck."""
        centre_x, centre_y, centre_z = _unpack_vector(self._centre)
        dx, dy, reach = x - centre_x, y - centre_y, self._bounding_radius + radius
        if not (-reach <= dx <= reach and -reach <= dy <= reach):
            return None
        qw, qx, qy, qz = _unpack_quaternion(self._orientation)
        normal_x, normal_y, normal_z = 2 * (qx * qz + qw * qy), 2 * (qy * qz - qw * qx), 1 - 2 * (qx * qx + qy * qy)
        if normal_z <= 0:
            return None
        dz = -(normal_x * dx + normal_y * dy) / normal_z
        forward = (1 - 2 * (qy * qy + qz * qz)) * dx + 2 * (qx * qy + qw * qz) * dy + 2 * (qx * qz - qw * qy) * dz
        left = 2 * (qx * qy - qw * qz) * dx + (1 - 2 * (qx * qx + qz * qz)) * dy + 2 * (qy * qz + qw * qx) * dz
        share = _share_of_rectangle(self._half_x, self._half_y, forward, left, radius)
        return (centre_z + dz, share) if share > 0 else None


class PlatformSurface:
    """The top of a platform."""

    def __init__(self, platform: Platform):
        self._x, self._y, z = platform.position
        edge_x, edge_y, edge_z = platform.size
        self._half_x, self._half_y, self._height = edge_x / 2, edge_y / 2, z + edge_z / 2

    def below(self, x: float, y: float, radius: float) -> Surface | None:
        """Return the plane of the top, or None if a disc of this radius (m) around (x, y) is beside the platform."""
        share = _share_of_rectangle(self._half_x, self._half_y, x - self._x, y - self._y, radius)
        return (self._height, share) if share > 0 else None


def _share_of_rectangle(half_x: float, half_y: float, x: float, y: float, radius: float) -> float:
    """Return the share of a disc at a position (m) above a rectangle around the origin."""
    inside_x, inside_y = half_x - abs(x), half_y - abs(y)
    if inside_x >= radius and inside_y >= radius:
        return 1.0
    if inside_x <= -radius or inside_y <= -radius:
        return 0.0
    return _share_of_strip(half_x, x, radius) * _share_of_strip(half_y, y, radius)


def _share_of_strip(half_width: float, position: float, radius: float) -> float:
    """Return the share of a disc at a position (m) above a strip around 0."""
    near, far = half_width - abs(position), half_width + abs(position)
    return max(_share_of_half_plane(near, radius) + _share_of_half_plane(far, radius) - 1, 0.0)


def _share_of_half_plane(distance: float, radius: float) -> float:
    """Return the share of a disc whose centre is at a distance (m) inside the edge of a half-plane."""
    if abs(distance) >= radius:
        return 1.0 if distance >= 0 else 0.0
    ratio = distance / radius
    return 0.5 + (ratio * math.sqrt(1 - ratio * ratio) + math.asin(ratio)) / math.pi


class GroundDistance:
    """Distances from points to the highest surface vertically below them."""

    def __init__(self, vessels: Sequence[ContactBody], platforms: Sequence[Platform], sea: Sea):
        decks, tops = [DeckSurface(vessel) for vessel in vessels], [PlatformSurface(platform) for platform in platforms]
        self._surfaces_below = [*(deck.below for deck in decks), *(top.below for top in tops)]
        self._elevation = sea.elevation_function() if len(sea.amplitude) else None

    def distance_and_share(
        self, x: float, y: float, z: float, radius: float, time: float, wave_gain: float
    ) -> tuple[float, float]:
        """Return the distance (m) below a point, 0 under water, and the share of a disc that is above this surface.

        Args:
            x: East position (m, world frame).
            y: North position (m, world frame).
            z: Height (m, world frame).
            radius: Radius of the disc (m).
            time: Time of the waves (s).
            wave_gain: Factor on all amplitudes (1).
        """
        highest, share = -math.inf, 0.0
        for surface_below in self._surfaces_below:
            surface = surface_below(x, y, radius)
            if surface and highest < surface[0] <= z:
                highest, share = surface
        if share:  # decks and platforms hide the water
            return z - highest, share
        level = wave_gain * self._elevation(x, y, time) if z < MAX_WAVE_EFFECT_HEIGHT and self._elevation else 0.0
        return max(z - level, 0.0), 1.0
