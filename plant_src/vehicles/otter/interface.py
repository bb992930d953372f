"""The variables of the Otter, in the order of its equations' vectors."""

from __future__ import annotations

from cosim.core.component import Variable
from cosim.core.units import parse

from ..common.interface import AFLOAT, CONTACT, CURRENT, DECK, EXTERNAL_LOADS, MOTION, WAVE_GAIN, WAVES, WIND, initial

PROPELLER_SPEED = Variable(
    "propeller_speed",
    "Float64",
    "input",
    start=(0.0, 0.0),
    unit=parse("rad/s"),
    shape=(2,),
    description="commanded speed of the propellers port, starboard; limited to what the motors reach",
)


def _parameter(name: str, unit: str, start: float, description: str, minimum: float | None, maximum: float | None) -> Variable:
    return Variable(name, "Float64", "parameter", "fixed", start, parse(unit), (), description, minimum, maximum)


PAYLOAD = (
    _parameter("payload_mass", "kg", 25.0, "mass of the payload", 0.0, 45.0),
    _parameter("payload_position.x", "m", 0.05, "payload ahead of the middle of the hull", -1.0, 1.0),
    _parameter("payload_position.y", "m", 0.0, "payload to port of the centre line", -0.5, 0.5),
    _parameter("payload_position.z", "m", 0.35, "payload above the waterline", -0.2, 1.0),
)
TIME_CONSTANT = _parameter("propeller_time_constant", "s", 0.1, "lag of the propellers' speed; 0: none", 0.0, None)

PARAMETERS = (*initial("xy", "uvw", "pqr"), *AFLOAT, *PAYLOAD, TIME_CONSTANT, *WAVES)
INPUTS = (PROPELLER_SPEED, *EXTERNAL_LOADS, *WIND, *CURRENT, *WAVE_GAIN)
VARIABLES = (*PARAMETERS, *INPUTS, *MOTION, *DECK, *CONTACT)

#: the states beside those of every vessel
SHAFTS = ("propeller_speed[1]", "propeller_speed[2]")

#: how many numbers the equations make of the parameters
CONSTANTS = 492
