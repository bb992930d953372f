"""Resistance of the catamaran's hulls to motion ahead and astern through the water.

The friction is that of the ITTC-57 line on the wetted surface (ITTC 1957, 8th conference, Madrid).
The residuary part is a smooth curve over the Froude number (`parameters.py`).
"""

from __future__ import annotations

import math

import casadi as ca

from ..common.elementary_functions import logarithm
from . import parameters as p


def resistance(u: ca.SX) -> ca.SX:
    """Return the surge force (N) of both hulls for a surge velocity relative to the water (m/s)."""
    square = u * u
    coefficient = friction_coefficient(u) + residuary_coefficient(square)
    return -p.WATER_DENSITY / 2 * p.WETTED_SURFACE * coefficient * ca.fabs(u) * u


def friction_coefficient(u: ca.SX) -> ca.SX:
    """Return 0.075 / (log10 Re - 2)^2 for a speed (m/s), with the value at `MIN_REYNOLDS_NUMBER` for slower flow."""
    ratio = ca.fmax(1, ca.fabs(u) * (p.HULL_LENGTH / p.VISCOSITY / p.MIN_REYNOLDS_NUMBER))
    exponent = logarithm(ratio) * (1 / math.log(10)) + (math.log10(p.MIN_REYNOLDS_NUMBER) - 2)
    return 0.075 / (exponent * exponent)


def residuary_coefficient(square: ca.SX) -> ca.SX:
    """Return the residuary coefficient for a squared speed (m2/s2).

    It rises with Fn^2 to its maximum and falls with Fn^-2.
    """
    share = square * (1 / (p.GRAVITY * p.HULL_LENGTH * p.RESIDUARY_PEAK_FROUDE_NUMBER**2))
    return p.RESIDUARY_PEAK * 2 * share / (1 + share * share)
