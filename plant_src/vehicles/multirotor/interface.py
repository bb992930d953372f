"""Variables of a multirotor, in the order of the equations.

The arrays of the rotors have as many elements as the airframe has rotors, or more: the equations of
all multirotors in a world are compiled once, for MAX_ROTORS rotors. Elements without a rotor are 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from cosim.core.component import Variable
from cosim.core.units import parse_unit

from ..common.inertia import inertia_variables
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
    element_labels,
    initial_variables,
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
    slots = len(airframe.rotors) if rotor_slots is None else rotor_slots
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        *_rigid_body_variables(airframe),
        *_hull_parameters(airframe),
        *_rotor_parameters(airframe, slots),
        *_effect_variables(airframe),
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
    return (*FREE_STATES, *(f"rotor_speed[{number}]" for number in range(1, rotor_slots + 1)))


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


def _hull_parameters(airframe: Airframe) -> tuple[Variable, ...]:
    hull = airframe.hull
    return (
        *_axis_parameters(
            "hull_size", "m", "edge of the box around the body, for forces in water", hull.size
        ),
        _parameter(
            "displaced_volume",
            "m3",
            "volume of water that the submerged vehicle displaces",
            hull.volume,
        ),
        _parameter(
            "water_drag_coefficient",
            "1",
            "drag coefficient of the body in water",
            hull.drag_coefficient,
        ),
    )


def _rotor_parameters(airframe: Airframe, slots: int) -> Iterator[Variable]:
    """Yield the number of rotors, their arrays, and what they have in common."""
    rotors = airframe.rotors
    yield replace(
        _parameter("rotor_count", "1", "number of rotors", float(len(rotors)), float(slots)),
        minimum=1.0,
    )
    vectors = (
        ("rotor_position", "m", "position of the hubs"),
        ("rotor_axis", "1", "unit vectors of the thrusts"),
    )
    for (name, unit, text), attribute in zip(vectors, ("position", "axis"), strict=True):
        for k, axis in enumerate("xyz"):
            values = [getattr(rotor, attribute)[k] for rotor in rotors]
            yield _rotor_array(f"{name}.{axis}", unit, f"{text}: {axis}, body frame", values, slots)
    thrust = [rotor.thrust_coefficient for rotor in rotors]
    yield _rotor_array(
        "thrust_coefficient", "N.s2/rad2", "thrust over squared speed", thrust, slots
    )
    torque = [rotor.torque_sign * rotor.torque_coefficient for rotor in rotors]
    text = (
        "signed reaction torque on the body about the axis over squared speed; this sign counts "
        "for the torque"
    )
    yield _rotor_array("torque_coefficient", "N.m.s2/rad2", text, torque, slots)
    signs = [rotor.torque_sign for rotor in rotors]
    yield _rotor_array(
        "torque_sign",
        "1",
        (
            "1: clockwise seen from the tip of the axis, -1: counter-clockwise; counts for rotor "
            "inertia only"
        ),
        signs,
        slots,
    )
    yield _parameter(
        "max_rotor_speed", "rad/s", "upper limit of the rotor speeds", airframe.max_rotor_speed
    )
    yield _parameter("rotor_radius", "m", "radius of the rotors", airframe.rotor_radius)


def _rotor_array(
    name: str, unit: str, description: str, values: Sequence[float], slots: int
) -> Variable:
    start = (*values, *[0.0] * (slots - len(values)))
    return Variable(
        name,
        "Float64",
        "parameter",
        "fixed",
        start,
        parse_unit(unit),
        (slots,),
        f"rotors: {description}",
    )


def _rotor_speed_variable(airframe: Airframe, slots: int) -> Variable:
    labels = element_labels([rotor.label for rotor in airframe.rotors], slots, "rotor_count")
    text = (
        f"commanded rotor speeds ({labels}), limited to 0 ... {airframe.max_rotor_speed:.4g} rad/s"
    )
    unit, start = parse_unit("rad/s"), (0.0,) * slots
    return Variable(
        "rotor_speed", "Float64", "input", start=start, unit=unit, shape=(slots,), description=text
    )


def _effect_variables(airframe: Airframe) -> tuple[Variable, ...]:
    effects = airframe.effects
    return (
        _parameter("initial_rotor_speed", "rad/s", "initial speed of all rotors, if they lag", 0.0),
        _parameter(
            "rotor_time_constant",
            "s",
            "time constant of the rotor speeds; 0: no lag",
            effects.rotor_time_constant,
        ),
        _parameter(
            "rotor_inertia",
            "kg.m2",
            "moment of inertia of a rotor with its motor; 0: no gyroscopic torque",
            effects.rotor_inertia,
        ),
        *_axis_parameters(
            "rotor_drag",
            "kg/rad",
            "drag of a rotor over its speed and air speed",
            effects.rotor_drag,
        ),
        *_axis_parameters(
            "body_drag", "kg/m", "drag of the body over squared air speed", effects.body_drag
        ),
        _parameter(
            "ground_effect",
            "1",
            "fraction of the ground effect; 0: none",
            effects.ground_effect,
            1.0,
        ),
        _parameter(
            "translational_lift",
            "kg/m",
            "thrust of a rotor over the squared air speed in its plane",
            effects.translational_lift,
        ),
    )


def _axis_parameters(
    name: str, unit: str, description: str, starts: tuple[float, float, float]
) -> tuple[Variable, ...]:
    named = zip("xyz", starts, strict=True)
    return tuple(
        _parameter(f"{name}.{axis}", unit, f"{description}: {axis}, body frame", start)
        for axis, start in named
    )


def _parameter(
    name: str, unit: str, description: str, start: float, maximum: float | None = None
) -> Variable:
    return replace(
        scalar_variable(name, unit, description, "parameter", start), minimum=0.0, maximum=maximum
    )
