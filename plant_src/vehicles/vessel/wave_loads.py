"""Kinematics of irregular waves averaged over a floating hull, as CasADi expressions: linear theory of deep water.

The elevation of the water is the sum over components of a cos(k (x cos d + y sin d) - w t + phase), w^2 = g k. Wave loads act
over the waterplane and down to the draught, not at one point. The waterplane is approximated by a Gaussian distribution with the
same second moments, for which the mean of a wave is known in closed form. It attenuates each component by

    exp(-(kx^2 rx^2 + ky^2 ry^2) / 2 - k T)

with the wave number (kx, ky) in the axes of the hull, the draught T, and the radii of gyration of the waterplane rx^2 = I_L / A,
ry^2 = I_T / A. This is the long-wave limit of the strip integrals of Faltinsen (1990), Sea Loads on Ships and Offshore
Structures, chapter 3. A hull thus follows long waves and hardly responds to waves shorter than itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from cosim.export.equations.simd_sum import sum_over_rows

from ..common.elementary_functions import exponential, sine_and_cosine
from ..common.interface import MAX_WAVE_COMPONENTS

GRAVITY = 9.81  # m/s2

_MIN_FREQUENCY = 1e-9  # rad/s; avoids division by 0 for unused components

_COLUMN_COUNT = 6  # of the wave table: amplitude, kx, ky, frequency, phase, g / frequency
_SURFACE_COLUMN_COUNT = 5  # needed for the elevation: the first five


@dataclass(frozen=True)
class Footprint:
    """Dimensions of a hull for its wave loads.

    Attributes:
        longitudinal: Squared radius of gyration of the waterplane along the hull, I_L / A (m2).
        transverse: Squared radius of gyration of the waterplane across the hull, I_T / A (m2).
        draught: Draught (m).
    """

    longitudinal: ca.SX
    transverse: ca.SX
    draught: ca.SX


@dataclass(frozen=True)
class WaveKinematics:
    """Motion of the water averaged over a hull, world frame.

    Attributes:
        elevation: Elevation above the still water (m).
        slopes: Slopes along x and y (1), shape (2,).
        velocity: Velocity of the water (m/s), shape (3,).
        acceleration: Acceleration of the water (m/s2), shape (3,).
    """

    elevation: ca.SX
    slopes: ca.SX
    velocity: ca.SX
    acceleration: ca.SX


def wave_table(footprint: Footprint, amplitude: ca.SX, frequency: ca.SX, direction: ca.SX, phase: ca.SX) -> ca.SX:
    """Return the table of components for `wave_kinematics`, column by column.

    Args:
        footprint: Dimensions of the hull; the part of the attenuation that does not depend on the heading is applied here.
        amplitude: Amplitudes (m), shape (MAX_WAVE_COMPONENTS,) like the following arguments.
        frequency: Angular frequencies (rad/s).
        direction: Directions of propagation, counter-clockwise from x (rad).
        phase: Phases at the origin (rad).
    """
    number = frequency**2 / GRAVITY
    celerity = GRAVITY / ca.fmax(frequency, _MIN_FREQUENCY)
    attenuated = amplitude * ca.exp(-(number**2) * footprint.transverse / 2 - number * footprint.draught)
    return ca.vertcat(attenuated, number * ca.cos(direction), number * ca.sin(direction), frequency, phase, celerity)


def _wave_term() -> ca.Function:
    """Return the function of one component: elevation, slopes, velocity and vertical acceleration."""
    common, row = ca.SX.sym("common", 6), ca.SX.sym("row", _COLUMN_COUNT)
    x, y, time, cos_yaw, sin_yaw, slenderness = ca.vertsplit(common)
    amplitude, kx, ky, frequency, phase, celerity = ca.vertsplit(row)
    ahead = kx * cos_yaw + ky * sin_yaw
    attenuated = amplitude * exponential(-slenderness * ahead * ahead)
    sine, cosine = (attenuated * value for value in sine_and_cosine(kx * x + ky * y - frequency * time + phase))
    slopes = -ca.vertcat(kx, ky) * sine
    velocity = ca.vertcat(celerity * kx * cosine, celerity * ky * cosine, frequency * sine)
    return ca.Function("wave", [common, row], [ca.vertcat(cosine, slopes, velocity, -(frequency**2) * cosine)])


def _elevation_term() -> ca.Function:
    """Return the function of one component of the free surface: (x, y, time) and a row of the table to the elevation."""
    place, row = ca.SX.sym("place", 3), ca.SX.sym("row", _SURFACE_COLUMN_COUNT)
    amplitude, kx, ky, frequency, phase = ca.vertsplit(row)
    angle = kx * place[0] + ky * place[1] - frequency * place[2] + phase
    return ca.Function("elevation_term", [place, row], [amplitude * sine_and_cosine(angle)[1]])


#: sums over all components, which the equations call as loops in C
WAVE_SUM = sum_over_rows("waves", _wave_term(), MAX_WAVE_COMPONENTS)
SURFACE_SUM = sum_over_rows("surface", _elevation_term(), MAX_WAVE_COMPONENTS)


def create_elevation_function() -> ca.Function:
    """Return the exported function from (x, y, time), number and table of components to the elevation (m)."""
    place, count, rows = ca.SX.sym("place", 3), ca.SX.sym("count"), ca.SX.sym("rows", MAX_WAVE_COMPONENTS, _SURFACE_COLUMN_COUNT)
    return ca.Function("water_elevation", [place, count, ca.vec(rows)], [SURFACE_SUM(place, count, rows)])


def wave_kinematics(
    position: ca.SX, heading: tuple[ca.SX, ca.SX], time: ca.SX, footprint: Footprint, count: ca.SX, table: ca.SX
) -> WaveKinematics:
    """Return the motion of the water averaged over a hull.

    Args:
        position: Centre of flotation (m, world frame), shape (2,).
        heading: Cosine and sine of the yaw angle.
        time: Time of the waves (s).
        footprint: Dimensions of the hull.
        count: Number of components.
        table: Components from `wave_table`.
    """
    common = ca.vertcat(position, time, *heading, (footprint.longitudinal - footprint.transverse) / 2)
    total = WAVE_SUM(common, count, ca.reshape(table, MAX_WAVE_COMPONENTS, _COLUMN_COUNT))
    slopes = total[1:3]
    return WaveKinematics(total[0], slopes, total[3:6], ca.vertcat(-GRAVITY * slopes, total[6]))
