"""Lift of the rudder.

Proportional to a sine of the angle of attack up to the stall angle, constant beyond.

`inflow_sign` is the sign of the yaw rate in the inflow angle: +1 as published, -1 for a rudder
behind the centre of mass.
"""

import math
import sys

import casadi as ca
from casadi import SX

from cosim.export.fmu.block import Block

from ...vehicles.common.interface import scalar_variable, vector_variables
from ...vehicles.strider import parameters as p
from . import VESSEL_INPUTS, force_model, planar_velocity, tunable_parameter

VARIABLES = (
    *VESSEL_INPUTS,
    scalar_variable(
        "rudder_angle", "rad", "deflection; positive: trailing edge and bow to starboard"
    ),
    tunable_parameter(
        "inflow_sign",
        1.0,
        "1",
        "sign of the yaw rate in the inflow angle: 1 as published, -1 physical",
    ),
    tunable_parameter("arm", p.RUDDER_ARM, "m", "distance of the rudder from the centre of mass"),
    tunable_parameter("area", p.RUDDER_AREA, "m2", "area of the blade"),
    tunable_parameter(
        "max_lift_coefficient", p.RUDDER_MAX_LIFT_COEFFICIENT, "1", "at and beyond the stall angle"
    ),
    tunable_parameter(
        "stall_angle",
        p.STALL_ANGLE,
        "rad",
        "angle of attack from which on the lift no longer grows",
    ),
    tunable_parameter("density", p.WATER_DENSITY, "kg/m3", "of the water"),
    *vector_variables("force", "xy", "N", "vessel body frame, at the rudder"),
)


def loads(inputs: SX, parameters: SX) -> SX:
    """Return X and Y (N)."""
    u, v, r = ca.vertsplit(planar_velocity(inputs[0:4]))
    rudder_angle = inputs[4]
    sign, arm, area, max_lift_coefficient, stall_angle, density = ca.vertsplit(parameters)
    inflow_angle = ca.atan((v + sign * arm * r) / (u + (u == 0) * sys.float_info.epsilon))
    attack = ca.fmin(1, ca.fmax(-1, (rudder_angle - inflow_angle) / stall_angle))
    lift = density / 2 * max_lift_coefficient * area * u**2 * ca.sin(math.pi / 2 * attack)
    return ca.vertcat(-lift * ca.sin(rudder_angle), lift * ca.cos(rudder_angle))


def block() -> Block:
    """Return the block of the FMU `rudder`."""
    return force_model("rudder", "Force of a rudder on a vessel", VARIABLES, loads)
