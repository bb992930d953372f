"""Rigid body of the catamaran in its body frame."""

from __future__ import annotations

from ..common.shapes import Body, Box
from .parameters import (
    CENTRE_OF_MASS_HEIGHT,
    DECK_TOP,
    DECK_X,
    DECK_Y,
    HULL_BEAM,
    HULL_BOTTOM,
    HULL_LENGTH,
    HULL_OFFSET,
    HULL_TOP,
    INERTIA,
    MASS,
)

#: centre of the top of the landing deck (m)
DECK_CENTRE = (sum(DECK_X) / 2, sum(DECK_Y) / 2, DECK_TOP)

#: dimensions from the published simulation model (m)
PLATE_THICKNESS = 0.023
HOUSING_SIZE = (0.30, 0.30, 0.05)  # edges of the box under the deck plate


def _hull_box(side: float) -> Box:
    half_extents = (HULL_LENGTH / 2, HULL_BEAM / 2, (HULL_TOP - HULL_BOTTOM) / 2)
    return Box(half_extents, (0.0, side * HULL_OFFSET, (HULL_TOP + HULL_BOTTOM) / 2))


def _plate_box() -> Box:
    half_extents = ((DECK_X[1] - DECK_X[0]) / 2, (DECK_Y[1] - DECK_Y[0]) / 2, PLATE_THICKNESS / 2)
    return Box(half_extents, (DECK_CENTRE[0], DECK_CENTRE[1], DECK_TOP - PLATE_THICKNESS / 2))


def _housing_box() -> Box:
    x, y, z = HOUSING_SIZE
    return Box(
        (x / 2, y / 2, z / 2), (DECK_CENTRE[0], DECK_CENTRE[1], DECK_TOP - PLATE_THICKNESS - z / 2)
    )


BODY = Body(
    MASS,
    INERTIA,
    (_plate_box(), _hull_box(+1.0), _hull_box(-1.0), _housing_box()),
    CENTRE_OF_MASS_HEIGHT,
)
