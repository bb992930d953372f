"""The variables of the catamaran, in the order of its equations' vectors."""

from __future__ import annotations

from ..common.interface import CONTACT, CURRENT, DECK, EXTERNAL_LOADS, MOTION, WIND, initial, scalar

THRUST = scalar("thrust", "N", "thrust along the body's x axis, at the height and lateral position of the centre of mass")
RUDDER_ANGLE = scalar("rudder_angle", "rad", "rudder deflection; positive: trailing edge and bow to starboard, yaw decreases")

INPUTS = (THRUST, RUDDER_ANGLE, *EXTERNAL_LOADS, *WIND, *CURRENT)
VARIABLES = (*initial("xy", "uv", "r"), *INPUTS, *MOTION, *DECK, *CONTACT)

STATES = ("position.x", "position.y", "attitude.yaw", "velocity_body.u", "velocity_body.v", "rates.r")
