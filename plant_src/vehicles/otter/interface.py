"""Variables of the Otter, in the order of the equations."""

from cosim.core.component import Variable
from cosim.core.units import parse_unit

from ..common.interface import (
    EXTERNAL_LOADS,
    FLOATING_INITIAL_PARAMETERS,
    FLOATING_INPUTS,
    VESSEL_OUTPUTS,
    WAVE_PARAMETERS,
    initial_variables,
    parameter,
)

PROPELLER_SPEED = Variable(
    "propeller_speed",
    "Float64",
    "input",
    start=(0.0, 0.0),
    unit=parse_unit("rad/s"),
    shape=(2,),
    description="commanded propeller speeds (port, starboard), limited to -101.7 ... 103.9 rad/s",
)

PAYLOAD_PARAMETERS = (
    parameter("payload_mass", "kg", 25.0, "mass of the payload", 0.0, 45.0),
    parameter("payload_position.x", "m", 0.05, "payload ahead of midships", -1.0, 1.0),
    parameter("payload_position.y", "m", 0.0, "payload to port of the centre line", -0.5, 0.5),
    parameter("payload_position.z", "m", 0.35, "payload above the waterline", -0.2, 1.0),
)
PROPELLER_TIME_CONSTANT = parameter(
    "propeller_time_constant", "s", 0.1, "time constant of the propeller speeds; 0: no lag", 0.0
)

VARIABLES = (
    *initial_variables("xy", "uvw", "pqr"),
    *FLOATING_INITIAL_PARAMETERS,
    *PAYLOAD_PARAMETERS,
    PROPELLER_TIME_CONSTANT,
    *WAVE_PARAMETERS,
    PROPELLER_SPEED,
    *EXTERNAL_LOADS,
    *FLOATING_INPUTS,
    *VESSEL_OUTPUTS,
)

#: actuator states
PROPELLER_STATES = ("propeller_speed[1]", "propeller_speed[2]")
