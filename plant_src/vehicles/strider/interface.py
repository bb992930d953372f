"""Variables of the catamaran, in the order of the equations."""

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    VESSEL_OUTPUTS,
    WIND_INPUTS,
    initial_variables,
    parameter,
    scalar_variable,
)

#: effects that the hull of the paper does not have
HULL_PARAMETERS = (
    parameter(
        "resistance",
        "1",
        1.0,
        "factor on friction and residuary resistance of the hulls; 0: none",
        0.0,
    ),
    parameter(
        "propeller_diameter",
        "m",
        0.08,
        "propeller in whose race the rudder is; 0: the rudder is in no race",
        0.0,
    ),
)

#: name of a hull -> its parameters
HULLS = {"paper": {"resistance": 0.0, "propeller_diameter": 0.0}}

THRUST = scalar_variable(
    "thrust",
    "N",
    "thrust along the body's x axis, at the height and lateral position of the centre of mass",
)
RUDDER_ANGLE = scalar_variable(
    "rudder_angle",
    "rad",
    "rudder angle; positive: trailing edge and bow to starboard, yaw decreases",
)

INPUTS = (THRUST, RUDDER_ANGLE, *EXTERNAL_LOADS, *WIND_INPUTS, *CURRENT_INPUTS)
VARIABLES = (
    *initial_variables("xy", "uv", "r"),
    *HULL_PARAMETERS,
    *INPUTS,
    *VESSEL_OUTPUTS,
)
