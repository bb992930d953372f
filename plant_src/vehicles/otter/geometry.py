"""Rigid body of the Otter in its body frame."""

from __future__ import annotations

from ..common.shapes import Body, Box
from .parameters import (
    DECK_CENTRE,
    DECK_SIZE,
    HULL_MASS,
    LENGTH,
    PONTOON_BEAM,
    PONTOON_BOTTOM,
    PONTOON_OFFSET,
    PONTOON_TOP,
    RADII_OF_GYRATION,
)


def _pontoon_box(side: float) -> Box:
    half_extents = (LENGTH / 2, PONTOON_BEAM / 2, (PONTOON_TOP - PONTOON_BOTTOM) / 2)
    return Box(half_extents, (0.0, side * PONTOON_OFFSET, (PONTOON_TOP + PONTOON_BOTTOM) / 2))


def _deck_box() -> Box:
    x, y, z = DECK_SIZE
    return Box((x / 2, y / 2, z / 2), (DECK_CENTRE[0], DECK_CENTRE[1], DECK_CENTRE[2] - z / 2))


_ROLL, _PITCH, _YAW = (HULL_MASS * radius**2 for radius in RADII_OF_GYRATION)
BODY = Body(HULL_MASS, (_ROLL, _PITCH, _YAW), (_deck_box(), _pontoon_box(+1.0), _pontoon_box(-1.0)))
