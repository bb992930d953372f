"""Strips of a twin hull: buoyancy of boxes cut by the surface of the water.

Each hull is divided into `STATION_COUNT` boxes of equal length. Their spacing and their distance from the centre line are those
of points with the moments of inertia of the waterplane, so that the static stiffness is exact. A hull that leaves the water loses
its buoyancy, so that the righting moment has a limit, and the vessel can capsize.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

#: stations of each hull; `wave_loads` has equations for this number
STATION_COUNT = 5
STRIP_COUNT = 2 * STATION_COUNT

_STATIONS = tuple(range(2, -3, -1))  # from bow to stern, in spacings
_MEAN_SQUARE = sum(station**2 for station in _STATIONS) / STATION_COUNT


@dataclass(frozen=True)
class Strips:
    """Positions of the strips: those of the port hull from bow to stern, then those of the starboard hull.

    Attributes:
        centre: Centre of the waterplane (m, body frame), shape (3,).
        spacing: Distance of the stations (m).
        offset: Distance of the strips from the centre line (m).
    """

    centre: ca.SX
    spacing: ca.SX
    offset: ca.SX

    @property
    def positions(self) -> list[tuple[ca.SX, ca.SX]]:
        """Positions ahead and to port of the centre (m)."""
        return [(station * self.spacing, side * self.offset) for side in (1, -1) for station in _STATIONS]

    @property
    def mean_scale(self) -> ca.SX:
        """Factors from the sums of `wave_loads` over one hull to mean heave, roll and pitch, shape (3,)."""
        return ca.vertcat(1, 1 / self.offset, 2 / (_MEAN_SQUARE * self.spacing)) / STATION_COUNT

    @property
    def radii_squared(self) -> ca.SX:
        """Squared radii of gyration of the waterplane about the axes ahead and to port (m2), shape (2,)."""
        return ca.vertcat(self.offset**2, _MEAN_SQUARE * self.spacing**2)

    def fit_plane(self, elevations: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return mean height (m), and roll and pitch angle (rad, shape (2,)) of the plane through the strips."""
        port, starboard = ca.vertsplit(elevations, STATION_COUNT)
        both = port + starboard
        roll = ca.sum1(port - starboard) / (STRIP_COUNT * self.offset)
        pitch = -sum(station * both[k] for k, station in enumerate(_STATIONS)) / (STRIP_COUNT * _MEAN_SQUARE * self.spacing)
        return ca.sum1(both) / STRIP_COUNT, ca.vertcat(roll, pitch)


def equivalent_strips(centre: ca.SX, moments: tuple[ca.SX, ca.SX], area: ca.SX) -> Strips:
    """Return the strips with the transverse and longitudinal second moments (m4) of a waterplane with an area (m2)."""
    transverse, longitudinal = moments
    return Strips(centre, ca.sqrt(longitudinal / area / _MEAN_SQUARE), ca.sqrt(transverse / area))


@dataclass(frozen=True)
class TwinHull:
    """Two hulls of boxes.

    Attributes:
        strips: Positions of the boxes.
        beam: Beam of a hull (m).
        draught: Mean draught at rest (m).
        depth: Height of the boxes (m).
        area: Area of the waterplane of both hulls (m2).
    """

    strips: Strips
    beam: ca.SX
    draught: ca.SX
    depth: ca.SX
    area: ca.SX


@dataclass(frozen=True)
class Immersion:
    """Immersed part of all strips.

    Attributes:
        volume: Displaced volume (m3).
        moment: Volume times its centre (m4, body frame), shape (3,).
        wetness: Mean share of the strips with water at their bottoms: 1 from half of the draught at rest on, 0 in the air.
    """

    volume: ca.SX
    moment: ca.SX
    wetness: ca.SX


def immersion(hull: TwinHull, up: ca.SX, height: ca.SX, elevations: ca.SX) -> Immersion:
    """Return the part of the boxes below the surface.

    A box is cut level at the elevation of its strip. The immersed share grows linearly over the largest of its three vertical
    extents, which is exact for a box that is not heeled beyond 45 degrees.

    Args:
        hull: Dimensions.
        up: Vertical axis of the world in the body frame, shape (3,).
        height: Height of the origin O above the still water (m).
        elevations: Elevations of the water at the strips (m).
    """
    strips, depth = hull.strips, hull.depth
    extent = ca.fmax(depth * ca.fabs(up[2]), ca.fmax(hull.beam * ca.fabs(up[1]), strips.spacing * ca.fabs(up[0])))
    scale = 1 / extent
    middle = strips.centre[2] - hull.draught + depth / 2
    lowest_shift = depth * depth * up[2] * scale / 2
    base = height + up[0] * strips.centre[0] + up[1] * strips.centre[1] + up[2] * middle
    total, moment, wetness = ca.SX(0), ca.SX.zeros(3), ca.SX(0)
    for k, (x, y) in enumerate(strips.positions):
        share = ca.fmin(1, ca.fmax(0, 0.5 + scale * (elevations[k] - base - up[0] * x - up[1] * y)))
        wet = ca.fmin(1, share * (2 * depth / hull.draught))
        total += share
        moment += share * ca.vertcat(x, y, lowest_shift * (share - 1))
        wetness += wet * (2 - wet)
    volume = hull.area * depth / STRIP_COUNT
    centre = ca.vertcat(strips.centre[0:2], middle)
    return Immersion(volume * total, volume * (moment + total * centre), wetness / STRIP_COUNT)
