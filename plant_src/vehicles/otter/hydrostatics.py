"""Hydrostatics and damping of the Otter with its payload, by the formulas of MSS (`parameters.py`)."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..vessel.hull import transformation_matrix
from . import parameters as p


@dataclass(frozen=True)
class Hydrostatics:
    """Hydrostatics for one mass and centre of mass.

    Attributes:
        draught: Draught (m).
        stiffness: Restoring stiffness of heave (N/m), roll and pitch (N m/rad) at the centre of flotation, shape (3,).
        compliance: Heave (m), roll and pitch (rad) over heave force (N), roll and pitch moment (N m) at O, shape (3, 3).
        mean_draught: Volume over waterplane (m).
    """

    draught: ca.SX
    stiffness: ca.SX
    compliance: ca.SX
    mean_draught: ca.SX


def hydrostatics(mass: ca.SX, centre: ca.SX) -> Hydrostatics:
    """Return the hydrostatics for a mass (kg) and a centre of mass (m, body frame)."""
    volume = mass / p.WATER_DENSITY
    draught = volume / (2 * p.BLOCK_COEFFICIENT * p.PONTOON_BEAM * p.LENGTH)
    moments = ca.SX([p.TRANSVERSE_MOMENT, p.LONGITUDINAL_MOMENT])
    buoyancy_height = (5 * draught / 2 - volume / (2 * p.LENGTH * p.PONTOON_BEAM)) / 3
    metacentric_heights = buoyancy_height + moments / volume - (draught + centre[2])
    weight = p.WATER_DENSITY * p.GRAVITY
    stiffness = ca.vertcat(weight * p.WATERPLANE_AREA, weight * volume * metacentric_heights)
    to_flotation = transformation_matrix(ca.SX(p.CENTRE_OF_FLOTATION))[2:5, 2:5]
    compliance = ca.inv(to_flotation.T @ ca.diag(stiffness) @ to_flotation)
    return Hydrostatics(draught, stiffness, compliance, volume / p.WATERPLANE_AREA)


def linear_damping(mass: ca.SX, stiffness: ca.SX) -> ca.SX:
    """Return the diagonal of the linear damping D, shape (6,), for the diagonal of M and `Hydrostatics.stiffness`."""
    frequencies = ca.sqrt(stiffness / mass[2:5])
    oscillating = 2 * ca.SX(p.DAMPING_RATIOS) * frequencies * mass[2:5]
    sway, yaw = p.DAMPING_TIME_CONSTANTS
    return ca.vertcat(p.MAX_THRUST / p.MAX_SPEED, mass[1] / sway, oscillating, mass[5] / yaw)


def cross_flow_drag(draught: ca.SX) -> ca.SX:
    """Return the cross-flow drag of one station over its squared velocity (N s2/m2) for a draught (m)."""
    slenderness, coefficients = zip(*p.CROSS_FLOW_DRAG_CURVE, strict=True)
    inside = ca.fmin(ca.fmax(p.PONTOON_BEAM / (2 * draught), slenderness[0]), slenderness[-1])
    coefficient = ca.pw_lin(inside, ca.DM(slenderness), ca.DM(coefficients))
    return p.WATER_DENSITY / 2 * draught * coefficient * p.LENGTH / (p.STATION_COUNT - 1)
