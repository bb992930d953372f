"""Variables of a multirotor, in the order of the equations.

The arrays of the rotors have as many elements as the airframe has rotors, or more: the equations of
all multirotors in a world are compiled once, for MAX_ROTORS rotors. Elements without a rotor are 0.
"""

from __future__ import annotations

from cosim.core.component import Variable

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    GROUND_INPUTS,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WIND_INPUTS,
    WORLD_OUTPUTS,
    attribute_parameters,
    element_commands,
    element_labels,
    element_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    parameter,
    scalar_variable,
)
from .airframe import Airframe

#: columns of the table of rotors in the constants of the equations: position, axis, thrust and
#: signed torque coefficient
ROTOR_TABLE_COLUMNS = 8

#: rows of that table for each rotor are filled up to a multiple of this number
_TABLE_ROW_MULTIPLE = 8


def variables(airframe: Airframe, rotor_slots: int | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs.

    Parameters other than `initial.*` start at the values of the airframe.

    Args:
        airframe: Data of the multirotor.
        rotor_slots: Number of elements of the arrays of the rotors. None means the number of
            rotors.
    """
    count, limit = len(airframe.rotors), f"0 ... {airframe.max_rotor_speed:.4g} rad/s"
    slots = count if rotor_slots is None else rotor_slots
    labels = element_labels([rotor.label for rotor in airframe.rotors], slots, "rotor_count")
    ground = "fraction of the ground effect; 0: none"
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        # `airframe.Airframe` checks the values of mass and inertia
        *inertia_variables(airframe.mass, airframe.inertia, "total mass with rotors and payload"),
        scalar_variable(
            "gravity", "m/s2", "gravitational acceleration", "parameter", airframe.gravity
        ),
        *attribute_parameters(airframe.hull, _HULL_PARAMETERS),
        parameter("rotor_count", "1", float(count), "number of rotors", 1.0, float(slots)),
        *element_parameters("rotor", airframe.rotors, _ROTOR_COLUMNS, slots),
        *attribute_parameters(airframe, _ROTOR_PARAMETERS),
        parameter(
            "initial_rotor_speed", "rad/s", 0.0, "initial speed of all rotors, if they lag", 0.0
        ),
        *attribute_parameters(airframe.effects, _EFFECT_PARAMETERS),
        parameter("ground_effect", "1", airframe.effects.ground_effect, ground, 0.0, 1.0),
        *attribute_parameters(airframe.effects, _LIFT_PARAMETERS),
        *EXTERNAL_LOADS,
        element_commands(
            "rotor_speed",
            "rad/s",
            f"commanded rotor speeds ({labels}), limited to {limit}",
            slots,
        ),
        *WIND_INPUTS,
        *GROUND_INPUTS,
        *WATER_LEVEL_INPUT,
        *CURRENT_INPUTS,
        *MOTION_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def states(rotor_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of the rigid body, then the rotor speeds."""
    return (*FREE_STATES, *element_states("rotor_speed", rotor_slots))


def table_rows(rotor_slots: int) -> int:
    """Return the number of rows of the table of rotors."""
    return -(-rotor_slots // _TABLE_ROW_MULTIPLE) * _TABLE_ROW_MULTIPLE


#: attribute, and name, unit, smallest value and description of its parameter
_HULL_PARAMETERS = (
    ("size", "hull_size", "m", 0.0, "edge of the box around the body, for forces in water"),
    (
        "volume",
        "displaced_volume",
        "m3",
        0.0,
        "volume of water that the submerged vehicle displaces",
    ),
    (
        "drag_coefficient",
        "water_drag_coefficient",
        "1",
        0.0,
        "drag coefficient of the body in water",
    ),
)
_ROTOR_PARAMETERS = (
    ("max_rotor_speed", "max_rotor_speed", "rad/s", 0.0, "upper limit of the rotor speeds"),
    ("rotor_radius", "rotor_radius", "m", 0.0, "radius of the rotors"),
)
_EFFECT_PARAMETERS = (
    (
        "rotor_time_constant",
        "rotor_time_constant",
        "s",
        0.0,
        "time constant of the rotor speeds; 0: no lag",
    ),
    (
        "rotor_inertia",
        "rotor_inertia",
        "kg.m2",
        0.0,
        "moment of inertia of a rotor with its motor; 0: no gyroscopic torque",
    ),
    ("rotor_drag", "rotor_drag", "kg/rad", 0.0, "drag of a rotor over its speed and air speed"),
    ("body_drag", "body_drag", "kg/m", 0.0, "drag of the body over squared air speed"),
)
_LIFT_PARAMETERS = (
    (
        "translational_lift",
        "translational_lift",
        "kg/m",
        0.0,
        "thrust of a rotor over the squared air speed in its plane",
    ),
)

#: attribute of a rotor, and name, unit and description of its array
_ROTOR_COLUMNS = (
    ("position", "rotor_position", "m", "position of the hubs"),
    ("axis", "rotor_axis", "1", "unit vectors of the thrusts"),
    ("thrust_coefficient", "thrust_coefficient", "N.s2/rad2", "thrust over squared speed"),
    (
        "signed_torque_coefficient",
        "torque_coefficient",
        "N.m.s2/rad2",
        "signed reaction torque on the body about the axis over squared speed; this sign counts "
        "for the torque",
    ),
    (
        "torque_sign",
        "torque_sign",
        "1",
        "1: clockwise seen from the tip of the axis, -1: counter-clockwise; counts for rotor "
        "inertia only",
    ),
)
