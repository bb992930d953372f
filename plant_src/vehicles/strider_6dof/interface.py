"""Variables of the catamaran in six degrees of freedom, in the order of the equations."""

from __future__ import annotations

from ..common.interface import (
    CURRENT_INPUTS,
    DECK_OUTPUTS,
    EXTERNAL_LOADS,
    FLOATING_INITIAL_PARAMETERS,
    MOTION_OUTPUTS,
    WAVE_GAIN_INPUT,
    WAVE_PARAMETERS,
    WIND_INPUTS,
    WORLD_OUTPUTS,
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

PARAMETERS = (
    *initial_variables("xy", "uvw", "pqr"),
    *FLOATING_INITIAL_PARAMETERS,
    *HULL_PARAMETERS,
    HYDRODYNAMICS_PARAMETER,
    *WAVE_PARAMETERS,
)
INPUTS = (THRUST, RUDDER_ANGLE, *EXTERNAL_LOADS, *WIND_INPUTS, *CURRENT_INPUTS, *WAVE_GAIN_INPUT)
VARIABLES = (*PARAMETERS, *INPUTS, *MOTION_OUTPUTS, *DECK_OUTPUTS, *WORLD_OUTPUTS)
