"""Kinematics of irregular waves at the strips of a twin hull, as CasADi expressions.

Linear theory of deep water.

The elevation of the water is the sum over components of a cos(k (x cos d + y sin d) - w t + phase),
w^2 = g k. It is evaluated at the centre of each strip (`strips.py`). The mean over the beam of a
strip reduces a component by exp(-k^2 B^2 / 24). Velocity and acceleration of the water are those at
half of the mean draught T, exp(-k T / 2), averaged over all strips.

A twin hull with the offset b of its hulls thus feels cos(k b) of the heave and sin(k b) / (k b) of
the slope of beam waves, as in strip theory (Faltinsen 1990, Sea Loads on Ships and Offshore
Structures, chapter 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from cosim.export.equations.simd_sum import sum_over_rows

from ..common.elementary_functions import sine_and_cosine
from ..common.interface import MAX_WAVE_COMPONENTS
from .strips import STRIP_COUNT, Strips, TwinHull

GRAVITY = 9.81  # m/s2

_COLUMN_COUNT = (
    8  # of the wave table: amplitude, kx, ky, frequency, phase, velocity along x, y and z
)


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

    elevations: ca.SX
    heave: ca.SX
    slopes: ca.SX
    velocity: ca.SX
    rates: ca.SX
    acceleration: ca.SX
    angular_acceleration: ca.SX


def wave_table(
    hull: TwinHull, amplitude: ca.SX, frequency: ca.SX, direction: ca.SX, phase: ca.SX
) -> ca.SX:
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

    Elevations of the strips, velocities, rates and accelerations.

    Elevation, velocity and acceleration of a rigid mean m of the wave exp(i angle) are Re(m), w
    Im(m) and -w^2 Re(m).
    """
    common, row = ca.SX.sym("common", 7), ca.SX.sym("row", _COLUMN_COUNT)
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
        (near, near_slope), (far, far_slope) = (
            (real * c, imaginary * s) for c, s in ((cosine_1, sine_1), (cosine_2, sine_2))
        )
        elevations += [far - far_slope, near - near_slope, real, near + near_slope, far + far_slope]
    mean, gradient = 1 + 2 * (cosine_1 + cosine_2), sine_1 + 2 * sine_2
    heave = cosine_across * mean
    real, imaginary = heave * cosine, heave * sine
    roll, pitch = sine_across * mean, cosine_across * gradient
    east, north, down = speeds
    velocities = [
        east * real,
        north * real,
        down * imaginary,
        down * roll * cosine,
        -down * pitch * cosine,
    ]
    east, north, down = (frequency * speed for speed in speeds)
    accelerations = [
        east * imaginary,
        north * imaginary,
        -down * real,
        down * roll * sine,
        -down * pitch * sine,
    ]
    return ca.Function(
        "wave", [common, row], [ca.vertcat(*elevations, *velocities, *accelerations)]
    )


#: sum over all components, which the equations call as a loop in C
WAVE_SUM = sum_over_rows("waves", _wave_term(), MAX_WAVE_COMPONENTS)


def water_motion(
    position: ca.SX,
    attitude: ca.SX,
    time: ca.SX,
    strips: Strips,
    gain: ca.SX,
    count: ca.SX,
    table: ca.SX,
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
