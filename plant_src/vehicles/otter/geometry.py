"""What Bullet knows of the Otter, in its body frame."""

from __future__ import annotations

from ..common.shapes import Body, Box
from .parameters import (
    DECK_CENTRE,
    DECK_SIZE,
    GYRATION,
    HULL_MASS,
    LENGTH,
    PONTOON_BEAM,
    PONTOON_BOTTOM,
    PONTOON_DISTANCE,
    PONTOON_TOP,
)


def _pontoon(side: float) -> Box:
    half_extents = (LENGTH / 2, PONTOON_BEAM / 2, (PONTOON_TOP - PONTOON_BOTTOM) / 2)
    return Box(half_extents, (0.0, side * PONTOON_DISTANCE, (PONTOON_TOP + PONTOON_BOTTOM) / 2))


def _deck() -> Box:
    x, y, z = DECK_SIZE
    return Box((x / 2, y / 2, z / 2), (DECK_CENTRE[0], DECK_CENTRE[1], DECK_CENTRE[2] - z / 2))


_ROLL, _PITCH, _YAW = (HULL_MASS * radius**2 for radius in GYRATION)
BODY = Body(HULL_MASS, (_ROLL, _PITCH, _YAW), (_deck(), _pontoon(+1.0), _pontoon(-1.0)))
