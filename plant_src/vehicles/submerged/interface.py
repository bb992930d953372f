"""Variables of a submerged vehicle, in the order of the equations.

The arrays of the thrusters have as many elements as the vehicle has thrusters, or more: the
equations of all submerged vehicles in a world are compiled once, for MAX_THRUSTERS thrusters.
Elements without a thruster are 0.
"""

from __future__ import annotations

from dataclasses import replace

from cosim.core.component import Variable

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WORLD_OUTPUTS,
    attribute_parameters,
    element_commands,
    element_labels,
    element_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    matrix_parameter,
)
from .craft import MATRICES, Craft

#: number of parts of the displaced volume
OCTANTS = 8


def variables(craft: Craft, thruster_slots: int | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs.

    Parameters other than `initial.*` start at the values of the craft.

    Args:
        craft: Data of the vehicle.
        thruster_slots: Number of elements of the arrays of the thrusters. None means the number of
            thrusters.
    """
    slots = len(craft.thrusters) if thruster_slots is None else thruster_slots
    labels = element_labels([thruster.label for thruster in craft.thrusters], slots, str(slots))
    limit = f"{craft.max_thruster_speed:.4g}"
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        *inertia_variables(craft.mass, craft.inertia, "total mass with the enclosed water"),
        *attribute_parameters(craft, _WATER_PARAMETERS),
        *(
            matrix_parameter(name, f"{text}, for u, v, w, p, q, r", getattr(craft, name))
            for name, text in MATRICES.items()
        ),
        *element_parameters("thruster", craft.thrusters, _THRUSTER_COLUMNS, slots),
        *attribute_parameters(craft, _THRUSTER_PARAMETERS),
        *EXTERNAL_LOADS,
        element_commands(
            "thruster_speed",
            "rad/s",
            f"commanded thruster speeds ({labels}), limited to -{limit} ... {limit} rad/s",
            slots,
        ),
        *CURRENT_INPUTS,
        replace(WATER_LEVEL_INPUT[0], start=0.0),
        *MOTION_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def states(thruster_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of the rigid body, then the thruster speeds."""
    return (*FREE_STATES, *element_states("thruster_speed", thruster_slots))


#: attribute, and name, unit, smallest value and description of its parameter
_WATER_PARAMETERS = (
    ("gravity", "gravity", "m/s2", 0.0, "gravitational acceleration"),
    ("water_density", "water_density", "kg/m3", 0.0, "density of the water"),
    (
        "displaced_volume",
        "displaced_volume",
        "m3",
        0.0,
        "volume of water that the submerged vehicle displaces",
    ),
    ("centre_of_buoyancy", "centre_of_buoyancy", "m", None, "centre of this volume"),
    ("size", "hull_size", "m", 0.0, "edge of the box of this volume"),
)
_THRUSTER_PARAMETERS = (
    (
        "max_thruster_speed",
        "max_thruster_speed",
        "rad/s",
        0.0,
        "largest magnitude of the speeds",
    ),
    ("thruster_radius", "thruster_radius", "m", 0.0, "radius of the propellers"),
    (
        "thruster_time_constant",
        "thruster_time_constant",
        "s",
        0.0,
        "time constant of the thruster speeds; 0: no lag",
    ),
    (
        "advance_coefficient",
        "advance_coefficient",
        "kg/rad",
        0.0,
        "loss of thrust over speed and axial velocity of the water",
    ),
)

#: attribute of a thruster, and name, unit and description of its array
_THRUSTER_COLUMNS = (
    ("position", "thruster_position", "m", "centres of the propellers"),
    ("axis", "thruster_axis", "1", "unit vectors of the thrusts"),
    (
        "thrust_coefficient",
        "thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at positive speeds",
    ),
    (
        "reverse_thrust_coefficient",
        "reverse_thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at negative speeds",
    ),
    (
        "torque_coefficient",
        "torque_coefficient",
        "N.m.s2/rad2",
        "reaction torque on the body about the axis over squared speed",
    ),
)
