"""Hydrostatics of the Otter with its payload, by the formulas of MSS (`../otter/parameters.py`)."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..otter import parameters as p
from ..vessel.hull import transformation_matrix


@dataclass(frozen=True)
class Hydrostatics:
    """Hydrostatics for one mass and centre of mass.

    Attributes:
        draught: Draught (m).
        stiffness: Restoring stiffness of heave (N/m), roll and pitch (N m/rad) at the centre of
            flotation, shape (3,).
        compliance: Heave (m), roll and pitch (rad) over heave force (N), roll and pitch moment (N
            m) at O, shape (3, 3).
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
    moments = ca.SX([p.TRANSVERSE_MOMENT, p.MSS_LONGITUDINAL_MOMENT])
    buoyancy_height = (5 * draught / 2 - volume / (2 * p.LENGTH * p.PONTOON_BEAM)) / 3
    metacentric_heights = buoyancy_height + moments / volume - (draught + centre[2])
    weight = p.WATER_DENSITY * p.GRAVITY
    stiffness = ca.vertcat(weight * p.WATERPLANE_AREA, weight * volume * metacentric_heights)
    to_flotation = transformation_matrix(ca.SX(p.CENTRE_OF_FLOTATION))[2:5, 2:5]
    compliance = ca.inv(to_flotation.T @ ca.diag(stiffness) @ to_flotation)
    return Hydrostatics(draught, stiffness, compliance, volume / p.WATERPLANE_AREA)
