"""The variables of the quadcopter, in the order of its equations' vectors."""

from __future__ import annotations

from cosim.component import Variable
from cosim.units import parse

from ..interface import CONTACT, EXTERNAL_LOADS, MOTION, initial

ROTOR_SPEED = Variable(
    "rotor_speed",
    "Float64",
    "input",
    start=(0.0,) * 4,
    unit=parse("rad/s"),
    shape=(4,),
    description="speed of the rotors front, left, rear, right; limited to what the motors reach",
)

VARIABLES = (*initial("xyz", "uvw", "pqr"), ROTOR_SPEED, *EXTERNAL_LOADS, *MOTION, *CONTACT)

STATES = (
    *(f"position.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
    *(f"velocity.{axis}" for axis in "xyz"),
    *(f"rates.{axis}" for axis in "pqr"),
)
