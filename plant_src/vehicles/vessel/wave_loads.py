"""What regular waves do to a floating hull, as CasADi expressions: linear theory of deep water.

Elevation of the water: sum over components of a cos(k (x cos d + y sin d) - w t + phase), w^2 = g k. A hull does not feel a
wave at one point but over its waterplane and down to its draught. The waterplane is taken as a Gaussian footprint with the
same second moments, whose mean of a wave is known: every component is attenuated by

    exp(-(kx^2 rx^2 + ky^2 ry^2) / 2 - k T)

with its wave number in the axes of the hull and the radii of gyration of the waterplane, rx^2 = I_L / A, ry^2 = I_T / A (the
long-wave limit of the strip integrals of Faltinsen 1990, Sea Loads on Ships and Offshore Structures, chapter 3). So long
waves carry the hull, and waves shorter than the hull pass under it.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from cosim.export.equations.simd_sum import sum_over_rows

from ..common.elementary_functions import exponential, sine_and_cosine
from ..common.interface import MAX_WAVE_COMPONENTS

GRAVITY = 9.81  # m/s2

_MIN_FREQUENCY = 1e-9  # rad/s: a wave of frequency 0 is no wave, not a division by 0

_COLUMN_COUNT = 6  # of the table: amplitude, kx, ky, frequency, phase, g / frequency
_SURFACE_COLUMN_COUNT = 5  # of the water itself: the first five


@dataclass(frozen=True)
class Footprint:
    """The waterplane: squares of its radii of gyration along and across the hull (m2), draught (m)."""

    longitudinal: ca.SX
    transverse: ca.SX
    draught: ca.SX


@dataclass(frozen=True)
class WaveKinematics:
    """What the hull feels of the waves, world frame: elevation (m), slopes along x and y, velocity (3, m/s) and acceleration
    (3, m/s2) of the water."""

    elevation: ca.SX
    slopes: ca.SX
    velocity: ca.SX
    acceleration: ca.SX


def wave_table(footprint: Footprint, amplitude: ca.SX, frequency: ca.SX, direction: ca.SX, phase: ca.SX) -> ca.SX:
    """The components as `water` needs them, column by column; the amplitude is that felt where the heading does not matter."""
    number = frequency**2 / GRAVITY
    celerity = GRAVITY / ca.fmax(frequency, _MIN_FREQUENCY)
    felt = amplitude * ca.exp(-(number**2) * footprint.transverse / 2 - number * footprint.draught)
    return ca.vertcat(felt, number * ca.cos(direction), number * ca.sin(direction), frequency, phase, celerity)


def _wave_term() -> ca.Function:
    """One component: elevation, slopes, velocity and vertical acceleration."""
    common, row = ca.SX.sym("common", 6), ca.SX.sym("row", _COLUMN_COUNT)
    x, y, time, cos_yaw, sin_yaw, slenderness = ca.vertsplit(common)
    amplitude, kx, ky, frequency, phase, celerity = ca.vertsplit(row)
    ahead = kx * cos_yaw + ky * sin_yaw
    felt = amplitude * exponential(-slenderness * ahead * ahead)
    sine, cosine = (felt * value for value in sine_and_cosine(kx * x + ky * y - frequency * time + phase))
    slopes = -ca.vertcat(kx, ky) * sine
    velocity = ca.vertcat(celerity * kx * cosine, celerity * ky * cosine, frequency * sine)
    return ca.Function("wave", [common, row], [ca.vertcat(cosine, slopes, velocity, -(frequency**2) * cosine)])


def _elevation_term() -> ca.Function:
    """One component of the free surface at (x, y, time): its row is amplitude, kx, ky, frequency and phase."""
    place, row = ca.SX.sym("place", 3), ca.SX.sym("row", _SURFACE_COLUMN_COUNT)
    amplitude, kx, ky, frequency, phase = ca.vertsplit(row)
    angle = kx * place[0] + ky * place[1] - frequency * place[2] + phase
    return ca.Function("undulation", [place, row], [amplitude * sine_and_cosine(angle)[1]])


#: called by the equations; loops in C
WAVE_SUM = sum_over_rows("waves", _wave_term(), MAX_WAVE_COMPONENTS)
SURFACE_SUM = sum_over_rows("surface", _elevation_term(), MAX_WAVE_COMPONENTS)


def create_elevation_function() -> ca.Function:
    """Place (x, y, time), number and table of components, column by column -> elevation of the water (m)."""
    place, count, rows = ca.SX.sym("place", 3), ca.SX.sym("count"), ca.SX.sym("rows", MAX_WAVE_COMPONENTS, _SURFACE_COLUMN_COUNT)
    return ca.Function("water_elevation", [place, count, ca.vec(rows)], [SURFACE_SUM(place, count, rows)])


def wave_kinematics(
    place: ca.SX, heading: tuple[ca.SX, ca.SX], time: ca.SX, footprint: Footprint, count: ca.SX, sea: ca.SX
) -> WaveKinematics:
    """The waves at a place (x, y), for a hull with this heading (cosine and sine of the yaw angle); `sea` is a `table`."""
    common = ca.vertcat(place, time, *heading, (footprint.longitudinal - footprint.transverse) / 2)
    felt = WAVE_SUM(common, count, ca.reshape(sea, MAX_WAVE_COMPONENTS, _COLUMN_COUNT))
    slopes = felt[1:3]
    return WaveKinematics(felt[0], slopes, felt[3:6], ca.vertcat(-GRAVITY * slopes, felt[6]))
