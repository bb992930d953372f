"""The variables of the catamaran in six degrees of freedom, in the order of its equations' vectors."""

from __future__ import annotations

from cosim.core.component import Variable
from cosim.core.units import parse

from ..common.interface import AFLOAT, CONTACT, CURRENT, DECK, EXTERNAL_LOADS, MOTION, WAVE_GAIN, WAVES, WIND, initial
from ..strider.interface import RUDDER_ANGLE, THRUST

HYDRODYNAMICS = Variable(
    "hydrodynamics",
    "Float64",
    "parameter",
    "fixed",
    1.0,
    parse("1"),
    (),
    "0 takes away the loads of water and air together with the weight: the vessel is a free rigid body",
    0.0,
    1.0,
)

PARAMETERS = (*initial("xy", "uvw", "pqr"), *AFLOAT, HYDRODYNAMICS, *WAVES)
INPUTS = (THRUST, RUDDER_ANGLE, *EXTERNAL_LOADS, *WIND, *CURRENT, *WAVE_GAIN)
VARIABLES = (*PARAMETERS, *INPUTS, *MOTION, *DECK, *CONTACT)

#: how many numbers the equations make of the parameters
CONSTANTS = 443
