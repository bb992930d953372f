"""Drag of still air, added to the load of the water.

The plant has one input for both (equation 10 of the paper).
"""

import casadi as ca
from casadi import SX

from cosim.export.fmu.block import Block

from ...vehicles.common.interface import scalar_variable, vector_variables
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
    *vector_variables(
        "water", "xy", "N", "hydrodynamic force, vessel body frame, at the centre of mass", "input"
    ),
    scalar_variable("water.n", "N.m", "hydrodynamic moment about z"),
    tunable_parameter(
        "coefficient", p.AIR_DRAG, "kg/m", "drag per square of the velocity, along and across"
    ),
    *load_outputs("load of water and air"),
)


def loads(inputs: SX, coefficient: SX) -> SX:
    """Return X, Y (N) and N (N m)."""
    u, v, _ = ca.vertsplit(planar_velocity(inputs[0:4]))
    return inputs[4:7] - coefficient * ca.vertcat(u * ca.fabs(u), v * ca.fabs(v), 0)


def block() -> Block:
    """Return the block of the FMU `air_drag`."""
    return force_model(
        "air_drag",
        "Drag of still air on a vessel, added to the load of the water",
        VARIABLES,
        loads,
    )
