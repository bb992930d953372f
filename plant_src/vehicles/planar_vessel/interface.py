"""Variables of a planar vessel that is given by data, in the order of the equations."""

from __future__ import annotations

from collections.abc import Iterator

from cosim.core.component import Variable

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    PLANAR_STATES,
    VESSEL_OUTPUTS,
    WIND_INPUTS,
    element_states,
    initial_variables,
    matrix_parameter,
    parameter,
)
from ..vessel.actuators import actuator_inputs, actuator_parameters
from ..vessel.boat import boat_parameters
from .planar_vessel import PlanarVessel

_INITIAL_PARAMETERS = initial_variables("xy", "uv", "r")


def variables(vessel: PlanarVessel, slots: tuple[int, int] | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs.

    Parameters other than `initial.*` start at the values of the vessel.

    Args:
        vessel: Data of the vessel.
        slots: Numbers of elements of the arrays of propellers and rudders. None means the numbers
            of the vessel.
    """
    slots = slots or vessel.slots
    return (
        *_INITIAL_PARAMETERS,
        parameter("mass", "kg", vessel.mass, "total mass", 0.0),
        parameter(
            "yaw_inertia",
            "kg.m2",
            vessel.yaw_inertia,
            "moment of inertia about the vertical axis through the centre of mass",
            0.0,
        ),
        *boat_parameters(vessel, "u, v, r"),
        *_damping_parameters(vessel),
        parameter("height", "m", vessel.height, "height of O above the still water"),
        *actuator_parameters(vessel.propellers, vessel.rudders, slots),
        *EXTERNAL_LOADS,
        *actuator_inputs(vessel.propellers, vessel.rudders, slots),
        *WIND_INPUTS,
        *CURRENT_INPUTS,
        *VESSEL_OUTPUTS,
    )


def _damping_parameters(vessel: PlanarVessel) -> Iterator[Variable]:
    dampings = zip("uvr", vessel.quadratic_damping, vessel.cubic_damping, strict=True)
    for letter, matrix, value in dampings:
        text = f"load over |{letter}| times velocity, for u, v, r"
        yield matrix_parameter(f"quadratic_damping.{letter}", text, matrix)
        text = f"load over {letter} cubed, SI units"
        yield parameter(f"cubic_damping.{letter}", "1", value, text, 0.0)


def states(propeller_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of a planar body, then the propeller speeds."""
    return (*PLANAR_STATES, *element_states("propeller_speed", propeller_slots))
