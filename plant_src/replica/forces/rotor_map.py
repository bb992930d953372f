"""Rotor map: thrust T = CT w^2 and torque Q = CD w^2 of each rotor.

The speed w follows the throttle without delay.
"""

import casadi as ca
from casadi import SX

from cosim.core.component import Variable
from cosim.core.units import parse_unit
from cosim.export.fmu.block import Block

from ..bus import THRUST_COEFFICIENT
from . import force_model, tunable_parameter

#: torque of a rotor over its squared speed as in the published model (N m s2/rad2); 2.38e-9 of
#: Table 2 of the paper cannot turn the vehicle
TORQUE_COEFFICIENT = 2.38e-7

MAX_SPEED = 5000 * 0.10471976  # rad/s; the factor from 1/min is rounded as published

VARIABLES = (
    Variable(
        "throttle",
        causality="input",
        start=(0.0,) * 4,
        unit=parse_unit("%"),
        shape=(4,),
        description="acts within 0 to 100",
    ),
    tunable_parameter("thrust_coefficient", THRUST_COEFFICIENT, "N.s2/rad2", "CT"),
    tunable_parameter("torque_coefficient", TORQUE_COEFFICIENT, "N.m.s2/rad2", "CD"),
    tunable_parameter("max_speed", MAX_SPEED, "rad/s", "rotor speed at full throttle"),
    Variable(
        "thrust",
        causality="output",
        unit=parse_unit("N"),
        shape=(4,),
        description="along the body's up",
    ),
    Variable(
        "torque",
        causality="output",
        unit=parse_unit("N.m"),
        shape=(4,),
        description="of the propeller",
    ),
)


def loads(throttle: SX, parameters: SX) -> SX:
    """Return four thrusts (N), then four torques (N m)."""
    thrust_coefficient, torque_coefficient, max_speed = ca.vertsplit(parameters)
    speed = ca.fmin(100, ca.fmax(0, throttle)) / 100 * max_speed
    return ca.vertcat(thrust_coefficient * speed**2, torque_coefficient * speed**2)


def block() -> Block:
    """Return the block of the FMU `rotor_map`."""
    return force_model(
        "rotor_map", "Thrust and torque of four rotors from their throttles", VARIABLES, loads
    )
