"""Strips of a twin hull: buoyancy of boxes cut by the surface of the water.

Each hull is divided into `STATION_COUNT` boxes of equal length. Their spacing and their distance
from the centre line are those of points with the moments of inertia of the waterplane, so that the
static stiffness is exact. A hull that leaves the water loses its buoyancy, so that the righting
moment has a limit, and the vessel can capsize. The bottoms are level, or each station has its own
(`TwinHull.boxes`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

#: stations of each hull; `wave_loads` has equations for this number
STATION_COUNT = 5
STRIP_COUNT = 2 * STATION_COUNT

_STATIONS = tuple(range(2, -3, -1))  # from bow to stern, in spacings
_MEAN_SQUARE = sum(station**2 for station in _STATIONS) / STATION_COUNT


@dataclass(frozen=True)
class Strips:
    """Positions of the strips.

    Those of the port hull from bow to stern, then those of the starboard hull.

    Attributes:
        centre: Centre of the waterplane (m, body frame), shape (3,).
        spacing: Distance of the stations (m).
        offset: Distance of the strips from the centre line (m).
    """

    centre: ca.SX
    spacing: ca.SX
    offset: ca.SX

    @property
    def stations(self) -> list[ca.SX]:
        """Positions of the stations ahead of the centre, from bow to stern (m)."""
        return [station * self.spacing for station in _STATIONS]

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
        pitch = -sum(station * both[k] for k, station in enumerate(_STATIONS)) / (
            STRIP_COUNT * _MEAN_SQUARE * self.spacing
        )
        return ca.sum1(both) / STRIP_COUNT, ca.vertcat(roll, pitch)


def equivalent_strips(centre: ca.SX, moments: tuple[ca.SX, ca.SX], area: ca.SX) -> Strips:
    """Return the strips with the transverse and longitudinal second moments (m4) of a waterplane with an area (m2)."""
    transverse, longitudinal = moments
    return Strips(centre, ca.sqrt(longitudinal / area / _MEAN_SQUARE), ca.sqrt(transverse / area))


@dataclass(frozen=True, eq=False)
class Box:
    """Boxes of both hulls at one station.

    Attributes:
        depth: Height (m).
        middle: Height of the middle above O (m).
        draught: Draught at rest (m).
        volume_share: Volume over the mean of all stations.
        wet_share: Weight of the station in `Immersion.wetness`, whose mean over the stations is 1.
    """

    depth: ca.SX
    middle: ca.SX
    draught: ca.SX
    volume_share: ca.SX | float = 1.0
    wet_share: ca.SX | float = 1.0


@dataclass(frozen=True)
class TwinHull:
    """Two hulls of boxes.

    Attributes:
        strips: Positions of the boxes.
        beam: Beam of a hull (m).
        draught: Mean draught at rest (m).
        depth: Mean height of the boxes (m).
        area: Area of the waterplane of both hulls (m2).
        stations: Boxes from bow to stern if they differ; otherwise their bottoms are `draught`
            below the waterplane.
    """

    strips: Strips
    beam: ca.SX
    draught: ca.SX
    depth: ca.SX
    area: ca.SX
    stations: Sequence[Box] = ()

    @property
    def boxes(self) -> Sequence[Box]:
        """Boxes from bow to stern."""
        level = Box(self.depth, self.strips.centre[2] - self.draught + self.depth / 2, self.draught)
        return self.stations or [level] * STATION_COUNT


@dataclass(frozen=True)
class Immersion:
    """Immersed part of all strips.

    Attributes:
        volume: Displaced volume (m3).
        moment: Volume times its centre (m4, body frame), shape (3,).
        wetness: Mean share of the strips with water at their bottoms: 1 from half of the draught at
            rest on, 0 in the air.
    """

    volume: ca.SX
    moment: ca.SX
    wetness: ca.SX


def immersion(hull: TwinHull, up: ca.SX, height: ca.SX, elevations: ca.SX) -> Immersion:
    """Return the part of the boxes below the surface.

    A box is cut level at the elevation of its strip. The immersed share grows linearly over the
    largest of its three vertical extents, which is exact for a box that is not heeled beyond 45
    degrees.

    Args:
        hull: Dimensions.
        up: Vertical axis of the world in the body frame, shape (3,).
        height: Height of the origin O above the still water (m).
        elevations: Elevations of the water at the strips (m).
    """
    boxes, offset = hull.boxes, hull.strips.offset
    cuts = {box: _cut(hull, box, up, height) for box in boxes}
    reference = boxes[0].middle
    total, moment, wetness = ca.SX(0), ca.SX.zeros(3), ca.SX(0)
    for k, (box, x) in enumerate(zip(boxes, hull.strips.stations, strict=True)):
        scale, lowest_shift, base = cuts[box]
        heights = base + up[0] * x + up[1] * offset, base + up[0] * x - up[1] * offset
        levels = elevations[k] - heights[0], elevations[k + STATION_COUNT] - heights[1]
        port, starboard = (ca.fmin(1, ca.fmax(0, 0.5 + scale * level)) for level in levels)
        # sums and differences of both hulls, so that a symmetric vessel has no moment at all about
        # its long axis
        part, difference = (
            box.volume_share * (port + starboard),
            box.volume_share * (port - starboard),
        )
        raised = box.volume_share * lowest_shift * (port * (port - 1) + starboard * (starboard - 1))
        total += part
        moment += ca.vertcat(
            part * x, difference * offset, part * (box.middle - reference) + raised
        )
        wet = [ca.fmin(1, share * (2 * box.depth / box.draught)) for share in (port, starboard)]
        wetness += box.wet_share * sum(share * (2 - share) for share in wet)
    volume = hull.area * hull.depth / STRIP_COUNT
    centre = ca.vertcat(hull.strips.centre[0:2], reference)
    return Immersion(volume * total, volume * (moment + total * centre), wetness / STRIP_COUNT)


def _cut(hull: TwinHull, box: Box, up: ca.SX, height: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return immersed share over water level (1/m), lever of the share's centre (m), height (m) of a box at the centre line."""
    centre, depth = hull.strips.centre, box.depth
    extent = ca.fmax(
        depth * ca.fabs(up[2]),
        ca.fmax(hull.beam * ca.fabs(up[1]), hull.strips.spacing * ca.fabs(up[0])),
    )
    scale = 1 / extent
    base = height + up[0] * centre[0] + up[1] * centre[1] + up[2] * box.middle
    return scale, depth * depth * up[2] * scale / 2, base
