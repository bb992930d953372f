"""Variables of the catamaran in six degrees of freedom, in the order of the equations."""

from ..common.interface import (
    EXTERNAL_LOADS,
    FLOATING_INITIAL_PARAMETERS,
    FLOATING_INPUTS,
    VESSEL_OUTPUTS,
    WAVE_PARAMETERS,
    initial_variables,
    parameter,
)
from ..strider.interface import HULL_PARAMETERS, RUDDER_ANGLE, THRUST

HYDRODYNAMICS_PARAMETER = parameter(
    "hydrodynamics",
    "1",
    1.0,
    "1: loads of water, air and weight act; 0: the vessel is a free rigid body",
    0.0,
    1.0,
)

VARIABLES = (
    *initial_variables("xy", "uvw", "pqr"),
    *FLOATING_INITIAL_PARAMETERS,
    *HULL_PARAMETERS,
    HYDRODYNAMICS_PARAMETER,
    *WAVE_PARAMETERS,
    THRUST,
    RUDDER_ANGLE,
    *EXTERNAL_LOADS,
    *FLOATING_INPUTS,
    *VESSEL_OUTPUTS,
)
