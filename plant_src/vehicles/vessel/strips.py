"""Strips of a twin hull: buoyancy of boxes cut by the surface, and irregular waves at them.

Each hull is divided into `STATION_COUNT` boxes of equal length. Their spacing and their distance
from the centre line are those of points with the moments of inertia of the waterplane, so that the
static stiffness is exact. A hull that leaves the water loses its buoyancy, so that the righting
moment has a limit, and the vessel can capsize. The bottoms are level, or each station has its own
(`TwinHull.boxes`).

Waves follow the linear theory of deep water. The elevation of the water is the sum over components
of a cos(k (x cos d + y sin d) - w t + phase), w^2 = g k. It is evaluated at the centre of each
strip. The mean over the beam of a strip reduces a component by exp(-k^2 B^2 / 24). Velocity and
acceleration of the water are those at half of the mean draught T, exp(-k T / 2), averaged over all
strips. A twin hull with the offset b of its hulls thus feels cos(k b) of the heave and
sin(k b) / (k b) of the slope of beam waves, as in strip theory (Faltinsen 1990, Sea Loads on Ships
and Offshore Structures, chapter 3).

The stations lie at -2, -1, 0, 1 and 2 spacings, so that one component needs the sines of two
angles only: those of the phase at the centre and of the phase of one spacing. Addition theorems
give the other stations and both hulls.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
from casadi import SX

from cosim.export.equations.c_code import sum_over_rows

from ..common.elementary_functions import sine_and_cosine
from ..common.interface import MAX_WAVE_COMPONENTS

GRAVITY = 9.81  # m/s2

#: stations of each hull; `_wave_term` has equations for this number
STATION_COUNT = 5
STRIP_COUNT = 2 * STATION_COUNT

_STATIONS = tuple(range(2, -3, -1))  # from bow to stern, in spacings
_MEAN_SQUARE = sum(station**2 for station in _STATIONS) / STATION_COUNT


#: columns of the wave table: amplitude, kx, ky, frequency, phase, velocity along x, y and z
_COLUMN_COUNT = 8


@dataclass(frozen=True)
class Strips:
    """Positions of the strips.

    Those of the port hull from bow to stern, then those of the starboard hull.

    Attributes:
        centre: Centre of the waterplane (m, body frame), shape (3,).
        spacing: Distance of the stations (m).
        offset: Distance of the strips from the centre line (m).
    """

    centre: SX
    spacing: SX
    offset: SX

    @property
    def stations(self) -> list[SX]:
        """Positions of the stations ahead of the centre, from bow to stern (m)."""
        return [station * self.spacing for station in _STATIONS]

    @property
    def mean_scale(self) -> SX:
        """Factors from the sums of `_wave_term` to mean heave, roll and pitch, shape (3,)."""
        return ca.vertcat(1, 1 / self.offset, 2 / (_MEAN_SQUARE * self.spacing)) / STATION_COUNT

    @property
    def radii_squared(self) -> SX:
        """Squared radii of gyration of the waterplane (m2), shape (2,).

        They belong to the axes ahead and to port.
        """
        return ca.vertcat(self.offset**2, _MEAN_SQUARE * self.spacing**2)

    def fit_plane(self, elevations: SX) -> tuple[SX, SX]:
        """Return the plane through the strips by least squares.

        Args:
            elevations: Elevations at the strips (m), shape (STRIP_COUNT,).

        Returns:
            Mean height (m), and roll and pitch angle (rad), shape (2,).
        """
        port, starboard = ca.vertsplit(elevations, STATION_COUNT)
        both = port + starboard
        roll = ca.sum1(port - starboard) / (STRIP_COUNT * self.offset)
        pitch = -sum(station * both[k] for k, station in enumerate(_STATIONS)) / (
            STRIP_COUNT * _MEAN_SQUARE * self.spacing
        )
        return ca.sum1(both) / STRIP_COUNT, ca.vertcat(roll, pitch)


def equivalent_strips(centre: SX, moments: tuple[SX, SX], area: SX) -> Strips:
    """Return the strips with the second moments of a waterplane.

    Args:
        centre: Centre of the waterplane (m, body frame), shape (3,).
        moments: Transverse and longitudinal second moment (m4).
        area: Area (m2).
    """
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

    depth: SX
    middle: SX
    draught: SX
    volume_share: SX | float = 1.0
    wet_share: SX | float = 1.0


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
    beam: SX
    draught: SX
    depth: SX
    area: SX
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

    volume: SX
    moment: SX
    wetness: SX


def immersion(hull: TwinHull, up: SX, height: SX, elevations: SX) -> Immersion:
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
    total, moment, wetness = SX(0), SX.zeros(3), SX(0)
    for k, (box, x) in enumerate(zip(boxes, hull.strips.stations, strict=True)):
        scale, lowest_shift, base = cuts[box]
        heights = base + up[0] * x + up[1] * offset, base + up[0] * x - up[1] * offset
        levels = elevations[k] - heights[0], elevations[k + STATION_COUNT] - heights[1]
        port, starboard = (ca.fmin(1, ca.fmax(0, 0.5 + scale * level)) for level in levels)
        # sums and differences of both hulls, so that a symmetric vessel has no moment at all about
        # its long axis
        part = box.volume_share * (port + starboard)
        difference = box.volume_share * (port - starboard)
        raised = box.volume_share * lowest_shift * (port * (port - 1) + starboard * (starboard - 1))
        total += part
        height_moment = part * (box.middle - reference) + raised
        moment += ca.vertcat(part * x, difference * offset, height_moment)
        wet = [ca.fmin(1, share * (2 * box.depth / box.draught)) for share in (port, starboard)]
        wetness += box.wet_share * sum(share * (2 - share) for share in wet)
    volume = hull.area * hull.depth / STRIP_COUNT
    centre = ca.vertcat(hull.strips.centre[0:2], reference)
    return Immersion(volume * total, volume * (moment + total * centre), wetness / STRIP_COUNT)


def _cut(hull: TwinHull, box: Box, up: SX, height: SX) -> tuple[SX, SX, SX]:
    """Return how the surface cuts a box.

    Returns:
        Immersed share over water level (1/m), lever of the share's centre (m), and height (m) of
        the box at the centre line.
    """
    centre, depth = hull.strips.centre, box.depth
    extent = ca.fmax(
        depth * ca.fabs(up[2]),
        ca.fmax(hull.beam * ca.fabs(up[1]), hull.strips.spacing * ca.fabs(up[0])),
    )
    scale = 1 / extent
    base = height + up[0] * centre[0] + up[1] * centre[1] + up[2] * box.middle
    return scale, depth * depth * up[2] * scale / 2, base


@dataclass(frozen=True)
class WaterMotion:
    """Motion of the water at a hull.

    Rotations are those of the plane through the strips, about the horizontal axes ahead and to
    port.

    Attributes:
        elevations: Elevation above the still water at each strip (m), shape (STRIP_COUNT,).
        heave: Mean elevation (m).
        slopes: Roll and pitch angle of the surface (rad), shape (2,).
        velocity: Mean velocity (m/s, world frame), shape (3,).
        rates: Mean roll and pitch rate (rad/s), shape (2,).
        acceleration: Mean acceleration (m/s2, world frame), shape (3,).
        angular_acceleration: Mean roll and pitch acceleration (rad/s2), shape (2,).
    """

    elevations: SX
    heave: SX
    slopes: SX
    velocity: SX
    rates: SX
    acceleration: SX
    angular_acceleration: SX


def wave_table(hull: TwinHull, amplitude: SX, frequency: SX, direction: SX, phase: SX) -> SX:
    """Return the table of components for `water_motion`, column by column.

    Args:
        hull: Dimensions of the hull.
        amplitude: Amplitudes (m), shape (MAX_WAVE_COMPONENTS,) like the following arguments.
        frequency: Angular frequencies (rad/s).
        direction: Directions of propagation, counter-clockwise from x (rad).
        phase: Phases at the origin (rad).
    """
    number = frequency**2 / GRAVITY
    east, north = ca.cos(direction), ca.sin(direction)
    mean_over_beam = amplitude * ca.exp(-(number**2) * hull.beam**2 / 24)
    speed = frequency * ca.exp(-number * hull.draught / 2)
    return ca.vertcat(
        mean_over_beam,
        number * east,
        number * north,
        frequency,
        phase,
        speed * east,
        speed * north,
        speed,
    )


def _wave_term() -> ca.Function:
    """Return the function of one component.

    Its results are the elevations of the strips, the mean velocity with its roll and pitch rate,
    and the same of the acceleration. Elevation, velocity and acceleration of a rigid mean m of the
    wave exp(i angle) are Re(m), w Im(m) and -w^2 Re(m).
    """
    common, row = SX.sym("common", 7), SX.sym("row", _COLUMN_COUNT)
    x, y, time, ahead_x, ahead_y, port_x, port_y = ca.vertsplit(common)
    amplitude, kx, ky, frequency, phase, *speeds = ca.vertsplit(row)
    sine, cosine = (
        amplitude * value for value in sine_and_cosine(kx * x + ky * y - frequency * time + phase)
    )
    sine_across, cosine_across = sine_and_cosine(kx * port_x + ky * port_y)
    sine_1, cosine_1 = sine_and_cosine(kx * ahead_x + ky * ahead_y)
    sine_2, cosine_2 = 2 * sine_1 * cosine_1, 2 * cosine_1 * cosine_1 - 1
    elevations = []
    for side in (1, -1):
        real = cosine * cosine_across - side * sine * sine_across
        imaginary = sine * cosine_across + side * cosine * sine_across
        near, near_slope = real * cosine_1, imaginary * sine_1
        far, far_slope = real * cosine_2, imaginary * sine_2
        elevations += [far - far_slope, near - near_slope, real, near + near_slope, far + far_slope]
    mean, gradient = 1 + 2 * (cosine_1 + cosine_2), sine_1 + 2 * sine_2
    heave = cosine_across * mean
    real, imaginary = heave * cosine, heave * sine
    roll, pitch = sine_across * mean, cosine_across * gradient
    east, north, down = speeds
    motion = [east * real, north * real, down * imaginary]
    motion += [down * roll * cosine, -down * pitch * cosine]
    east, north, down = (frequency * speed for speed in speeds)
    motion += [east * imaginary, north * imaginary, -down * real]
    motion += [down * roll * sine, -down * pitch * sine]
    return ca.Function("wave", [common, row], [ca.vertcat(*elevations, *motion)])


#: sum over all components, which the equations call as a loop in C
WAVE_SUM = sum_over_rows("waves", _wave_term(), MAX_WAVE_COMPONENTS)


def water_motion(
    position: SX,
    attitude: SX,
    time: SX,
    strips: Strips,
    gain: SX,
    count: SX,
    table: SX,
) -> WaterMotion:
    """Return the motion of the water at the strips of a hull.

    Args:
        position: Centre of the strips (m, world frame), shape (2,).
        attitude: Rotation matrix body to world frame.
        time: Time of the waves (s).
        strips: Positions of the strips.
        gain: Factor on all amplitudes.
        count: Number of components.
        table: Components from `wave_table`.
    """
    common = ca.vertcat(
        position, time, strips.spacing * attitude[0:2, 0], strips.offset * attitude[0:2, 1]
    )
    total = gain * WAVE_SUM(common, count, ca.reshape(table, MAX_WAVE_COMPONENTS, _COLUMN_COUNT))
    elevations, rates, accelerations = ca.vertsplit(
        total, [0, STRIP_COUNT, STRIP_COUNT + 5, STRIP_COUNT + 10]
    )
    scale = strips.mean_scale
    return WaterMotion(
        elevations,
        *strips.fit_plane(elevations),
        scale[0] * rates[0:3],
        scale[1:3] * rates[3:5],
        scale[0] * accelerations[0:3],
        scale[1:3] * accelerations[3:5],
    )
