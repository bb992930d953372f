"""Pontoons of the Otter as strips whose bottoms rise from bow to stern."""

from __future__ import annotations

import casadi as ca

from ..vessel.hydrostatics import upward_axis
from ..vessel.strips import STATION_COUNT, Box, TwinHull, equivalent_strips
from . import parameters as p

STRIPS = equivalent_strips(
    ca.SX(p.CENTRE_OF_FLOTATION),
    (ca.SX(p.TRANSVERSE_MOMENT), ca.SX(p.LONGITUDINAL_MOMENT)),
    ca.SX(p.WATERPLANE_AREA),
)

#: smallest draught at rest of a station (m), for payloads that lift it out of the water
_MIN_DRAUGHT = 1e-3

_DEPTHS = [draught + p.PONTOON_TOP for draught in p.STATION_DRAUGHTS]
_MEAN_DEPTH = sum(_DEPTHS) / STATION_COUNT


def resting_pontoons(draughts: ca.SX, mean_draught: ca.SX) -> TwinHull:
    """Return the pontoons.

    Args:
        draughts: Draughts of the stations at rest from bow to stern (m), shape (STATION_COUNT,).
        mean_draught: Displaced volume over the area of the waterplane (m).
    """
    positive = ca.fmax(draughts, _MIN_DRAUGHT)
    weights = STATION_COUNT / ca.sum1(positive) * positive
    boxes = [
        Box(ca.SX(depth), ca.SX(p.PONTOON_TOP - depth / 2), draught, depth / _MEAN_DEPTH, weight)
        for depth, draught, weight in zip(
            _DEPTHS, ca.vertsplit(positive), ca.vertsplit(weights), strict=True
        )
    ]
    return TwinHull(
        STRIPS,
        ca.SX(p.PONTOON_BEAM),
        mean_draught,
        ca.SX(_MEAN_DEPTH),
        ca.SX(p.WATERPLANE_AREA),
        boxes,
    )


def station_draughts(equilibrium: ca.SX) -> ca.SX:
    """Return the draughts of the stations (m) for height of O (m), roll and pitch (rad) at rest."""
    up = upward_axis(equilibrium)
    bottoms = zip(STRIPS.stations, p.STATION_DRAUGHTS, strict=True)
    return ca.vertcat(
        *(
            up[2] * draught - equilibrium[0] - up[0] * (STRIPS.centre[0] + x)
            for x, draught in bottoms
        )
    )
