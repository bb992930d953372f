"""Variables of a multirotor, in the order of the equations.

The arrays of the rotors have as many elements as the airframe has rotors, or more: the equations of
all multirotors in a world are compiled once, for MAX_ROTORS rotors. Elements without a rotor are 0.
"""

from __future__ import annotations

from collections.abc import Iterator

from cosim.core.component import Variable

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    GROUND_DISTANCE_INPUT,
    GROUND_SHARE_INPUT,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WIND_INPUTS,
    WORLD_OUTPUTS,
    element_commands,
    element_labels,
    element_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    parameter,
    scalar_variable,
    vector_parameters,
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
    slots = len(airframe.rotors) if rotor_slots is None else rotor_slots
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        *_rigid_body_variables(airframe),
        *_hull_parameters(airframe),
        *_rotor_parameters(airframe, slots),
        *_effect_parameters(airframe),
        *EXTERNAL_LOADS,
        _rotor_speed_variable(airframe, slots),
        *WIND_INPUTS,
        *GROUND_DISTANCE_INPUT,
        *GROUND_SHARE_INPUT,
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


def _rigid_body_variables(airframe: Airframe) -> tuple[Variable, ...]:
    """Return mass and inertia; `airframe.Airframe` checks their values."""
    gravity = scalar_variable(
        "gravity", "m/s2", "gravitational acceleration", "parameter", airframe.gravity
    )
    return (
        *inertia_variables(airframe.mass, airframe.inertia, "total mass with rotors and payload"),
        gravity,
    )


def _hull_parameters(airframe: Airframe) -> Iterator[Variable]:
    hull = airframe.hull
    text = "edge of the box around the body, for forces in water"
    yield from vector_parameters("hull_size", "m", hull.size, text, 0.0)
    text = "volume of water that the submerged vehicle displaces"
    yield parameter("displaced_volume", "m3", hull.volume, text, 0.0)
    text = "drag coefficient of the body in water"
    yield parameter("water_drag_coefficient", "1", hull.drag_coefficient, text, 0.0)


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


def _rotor_parameters(airframe: Airframe, slots: int) -> Iterator[Variable]:
    """Yield the number of rotors, their arrays, and what they have in common."""
    count = float(len(airframe.rotors))
    yield parameter("rotor_count", "1", count, "number of rotors", 1.0, float(slots))
    yield from element_parameters("rotor", airframe.rotors, _ROTOR_COLUMNS, slots)
    limit = airframe.max_rotor_speed
    yield parameter("max_rotor_speed", "rad/s", limit, "upper limit of the rotor speeds", 0.0)
    yield parameter("rotor_radius", "m", airframe.rotor_radius, "radius of the rotors", 0.0)


def _rotor_speed_variable(airframe: Airframe, slots: int) -> Variable:
    labels = element_labels([rotor.label for rotor in airframe.rotors], slots, "rotor_count")
    limit = f"limited to 0 ... {airframe.max_rotor_speed:.4g} rad/s"
    text = f"commanded rotor speeds ({labels}), {limit}"
    return element_commands("rotor_speed", "rad/s", text, slots)


def _effect_parameters(airframe: Airframe) -> Iterator[Variable]:
    effects = airframe.effects
    text = "initial speed of all rotors, if they lag"
    yield parameter("initial_rotor_speed", "rad/s", 0.0, text, 0.0)
    text = "time constant of the rotor speeds; 0: no lag"
    yield parameter("rotor_time_constant", "s", effects.rotor_time_constant, text, 0.0)
    text = "moment of inertia of a rotor with its motor; 0: no gyroscopic torque"
    yield parameter("rotor_inertia", "kg.m2", effects.rotor_inertia, text, 0.0)
    text = "drag of a rotor over its speed and air speed"
    yield from vector_parameters("rotor_drag", "kg/rad", effects.rotor_drag, text, 0.0)
    text = "drag of the body over squared air speed"
    yield from vector_parameters("body_drag", "kg/m", effects.body_drag, text, 0.0)
    text = "fraction of the ground effect; 0: none"
    yield parameter("ground_effect", "1", effects.ground_effect, text, 0.0, 1.0)
    text = "thrust of a rotor over the squared air speed in its plane"
    yield parameter("translational_lift", "kg/m", effects.translational_lift, text, 0.0)
