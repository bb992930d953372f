"""Variables of a multirotor, in the order of the equations."""

from __future__ import annotations

from dataclasses import replace

from cosim.core.component import Variable
from cosim.core.units import parse_unit

from ..common.interface import (
    EXTERNAL_LOADS,
    GROUND_DISTANCE_INPUT,
    MOTION_OUTPUTS,
    WIND_INPUTS,
    WORLD_OUTPUTS,
    initial_variables,
    scalar_variable,
)
from .airframe import Airframe

#: parameter -> row and column in the symmetric inertia tensor
INERTIA_INDICES = {f"inertia.{'xyz'[i]}{'xyz'[j]}": (i, j) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))}


def variables(airframe: Airframe) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs; parameters other than `initial.*` start at the values of the airframe."""
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        *_rigid_body_variables(airframe),
        *_effect_variables(airframe),
        _rotor_speed_variable(airframe),
        *EXTERNAL_LOADS,
        *WIND_INPUTS,
        *GROUND_DISTANCE_INPUT,
        *MOTION_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def states(airframe: Airframe) -> tuple[str, ...]:
    """Return the names of the states: those of the rigid body, then the rotor speeds."""
    groups = {"position": "xyz", "orientation": "wxyz", "velocity": "xyz", "rates": "pqr"}
    rigid = [f"{group}.{axis}" for group, axes in groups.items() for axis in axes]
    return (*rigid, *(f"rotor_speed[{number}]" for number in range(1, len(airframe.rotors) + 1)))


def constant_count(airframe: Airframe) -> int:
    """Return the number of constants of the equations: the parameters and the inverse of the inertia tensor."""
    return 9 + sum(len(variable.scalar_names) for variable in variables(airframe) if variable.causality == "parameter")


def _rigid_body_variables(airframe: Airframe) -> tuple[Variable, ...]:
    """Return mass and inertia; `airframe.Airframe` checks their values."""
    mass = scalar_variable("mass", "kg", "total mass with rotors and payload", "parameter", airframe.mass)
    text = "inertia tensor about the centre of mass, body frame, rotors locked"
    elements = {name: float(airframe.inertia[place]) for name, place in INERTIA_INDICES.items()}
    tensor = (scalar_variable(name, "kg.m2", f"{text}: {name[-2:]}", "parameter", value) for name, value in elements.items())
    return (mass, *tensor)


def _rotor_speed_variable(airframe: Airframe) -> Variable:
    labels = ", ".join(rotor.label for rotor in airframe.rotors)
    text = f"commanded rotor speeds ({labels}), limited to 0 ... {airframe.max_rotor_speed:.4g} rad/s"
    count = len(airframe.rotors)
    return Variable(
        "rotor_speed", "Float64", "input", start=(0.0,) * count, unit=parse_unit("rad/s"), shape=(count,), description=text
    )


def _effect_variables(airframe: Airframe) -> tuple[Variable, ...]:
    effects = airframe.effects
    return (
        _parameter("initial_rotor_speed", "rad/s", "initial speed of all rotors, if they lag", 0.0, airframe.max_rotor_speed),
        _parameter("rotor_time_constant", "s", "time constant of the rotor speeds; 0: no lag", effects.rotor_time_constant),
        _parameter(
            "rotor_inertia",
            "kg.m2",
            "moment of inertia of a rotor with its motor; 0: no gyroscopic torque",
            effects.rotor_inertia,
        ),
        *_axis_parameters("rotor_drag", "kg/rad", "drag of a rotor over its speed and air speed", effects.rotor_drag),
        *_axis_parameters("body_drag", "kg/m", "drag of the body over squared air speed", effects.body_drag),
        _parameter("ground_effect", "1", "fraction of the ground effect; 0: none", effects.ground_effect, 1.0),
    )


def _axis_parameters(name: str, unit: str, description: str, starts: tuple[float, float, float]) -> tuple[Variable, ...]:
    named = zip("xyz", starts, strict=True)
    return tuple(_parameter(f"{name}.{axis}", unit, f"{description}: {axis}, body frame", start) for axis, start in named)


def _parameter(name: str, unit: str, description: str, start: float, maximum: float | None = None) -> Variable:
    return replace(scalar_variable(name, unit, description, "parameter", start), minimum=0.0, maximum=maximum)
