"""Variables of the catamaran, in the order of the equations."""

from __future__ import annotations

from ..common.interface import (
    CURRENT_INPUTS,
    DECK_OUTPUTS,
    EXTERNAL_LOADS,
    MOTION_OUTPUTS,
    WIND_INPUTS,
    WORLD_OUTPUTS,
    initial_variables,
    scalar_variable,
)

THRUST = scalar_variable(
    "thrust", "N", "thrust along the body's x axis, at the height and lateral position of the centre of mass"
)
RUDDER_ANGLE = scalar_variable("rudder_angle", "rad", "rudder angle; positive: trailing edge and bow to starboard, yaw decreases")

INPUTS = (THRUST, RUDDER_ANGLE, *EXTERNAL_LOADS, *WIND_INPUTS, *CURRENT_INPUTS)
VARIABLES = (*initial_variables("xy", "uv", "r"), *INPUTS, *MOTION_OUTPUTS, *DECK_OUTPUTS, *WORLD_OUTPUTS)

STATES = ("position.x", "position.y", "attitude.yaw", "velocity_body.u", "velocity_body.v", "rates.r")
