"""Equilibrium of a floating vessel at rest, from the boxes of the strips (`vessel/strips.py`) in numbers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from .surface_vessel import SurfaceVessel

_STATIONS = np.tile([2.0, 1.0, 0.0, -1.0, -2.0], 2)  # of both hulls from bow to stern, in spacings
_SIDES = np.repeat([1.0, -1.0], 5)
_ITERATIONS = 200


class Rest(NamedTuple):
    """Heel and trim at rest (rad, positive to starboard and by the bow), and height of the lowest deck edge above water (m)."""

    heel: float
    trim: float
    freeboard: float


def rest(vessel: SurfaceVessel) -> Rest | None:
    """Return the attitude at rest on calm water.

    None if the vessel has none, so that it capsizes.
    """
    hull = vessel.hull
    middle, centre = hull.bottom + hull.depth / 2, np.array(vessel.centre_of_mass)
    spacing, offset = (
        math.sqrt(hull.longitudinal_moment / hull.area / 2),
        math.sqrt(hull.transverse_moment / hull.area),
    )
    points = np.column_stack(
        [hull.waterplane_centre + spacing * _STATIONS, offset * _SIDES, np.full(10, middle)]
    )
    strip_mass = vessel.water_density * hull.area * hull.depth / 10
    height, roll, pitch = -hull.bottom - vessel.draught, 0.0, 0.0
    for _ in range(_ITERATIONS):
        up = np.array(
            [-math.sin(pitch), math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch)]
        )
        extent = max(hull.depth * abs(up[2]), hull.strip_beam * abs(up[1]), spacing * abs(up[0]))
        share = np.clip(0.5 - (height + points @ up) / extent, 0, 1)
        lifted = points.copy()
        lifted[:, 2] += hull.depth**2 * up[2] / extent / 2 * (share - 1)
        force = strip_mass * share.sum() - vessel.mass
        lever = (
            strip_mass * share @ lifted
            - vessel.mass * centre
            - force * np.array([hull.waterplane_centre, 0, 0])
        )
        turn = np.cross(lever, up)[:2] / (vessel.mass * np.array(vessel.metacentric_heights))
        height += (
            force / (vessel.water_density * hull.area) + hull.waterplane_centre * turn[1]
        ) / 2
        roll, pitch = roll + turn[0] / 2, pitch + turn[1] / 2
        if not max(abs(roll), abs(pitch)) < math.pi / 3:
            return None
    edges = [
        (hull.waterplane_centre + x * hull.length / 2, y * (hull.offset + hull.beam / 2))
        for x in (-1, 1)
        for y in (-1, 1)
    ]
    freeboard = min(height + float(np.dot((x, y, hull.bottom + hull.depth), up)) for x, y in edges)
    return Rest(roll, pitch, freeboard)
