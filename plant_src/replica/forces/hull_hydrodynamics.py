"""Linear damping of sway and yaw, equations 12 and 13 of the paper, once for each hull.

Surge has no damping.
"""

import casadi as ca
from casadi import SX

from cosim.export.fmu.block import Block

from ...vehicles.strider import parameters as p
from . import (
    VESSEL_INPUTS,
    force_model,
    load_outputs,
    planar_velocity,
    tunable_parameter,
)

VARIABLES = (
    *VESSEL_INPUTS,
    tunable_parameter(
        "hulls", float(p.HULL_COUNT), "1", "number of hulls; 1: as the paper's equations read"
    ),
    tunable_parameter("Y_v", p.Y_V, "kg/s", "side force of one hull per sway velocity"),
    tunable_parameter("Y_r", p.Y_R, "kg.m/s", "side force of one hull per yaw rate"),
    tunable_parameter("N_v", p.N_V, "kg.m/s", "yaw moment of one hull per sway velocity"),
    tunable_parameter("N_r", p.N_R, "kg.m2/s", "yaw moment of one hull per yaw rate"),
    *load_outputs("hydrodynamic load"),
)


def loads(motion: SX, parameters: SX) -> SX:
    """Return X, Y (N) and N (N m)."""
    _, v, r = ca.vertsplit(planar_velocity(motion))
    hulls, y_v, y_r, n_v, n_r = ca.vertsplit(parameters)
    return ca.vertcat(0, hulls * (y_v * v + y_r * r), hulls * (n_v * v + n_r * r))


def block() -> Block:
    """Return the block of the FMU `hull_hydrodynamics`."""
    return force_model(
        "hull_hydrodynamics", "Hydrodynamic load on the hulls of a vessel", VARIABLES, loads
    )
