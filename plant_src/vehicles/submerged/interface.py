"""Variables of a submerged vehicle, in the order of the equations.

The arrays of the thrusters have as many elements as the vehicle has thrusters, or more: the
equations of all submerged vehicles in a world are compiled once, for MAX_THRUSTERS thrusters.
Elements without a thruster are 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from cosim.core.component import Variable

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WORLD_OUTPUTS,
    element_commands,
    element_labels,
    element_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    matrix_parameter,
    parameter,
    vector_parameters,
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
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        *inertia_variables(craft.mass, craft.inertia, "total mass with the enclosed water"),
        *_water_parameters(craft),
        *_thruster_parameters(craft, slots),
        *EXTERNAL_LOADS,
        _thruster_speed_variable(craft, slots),
        *CURRENT_INPUTS,
        replace(WATER_LEVEL_INPUT[0], start=0.0),
        *MOTION_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def states(thruster_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of the rigid body, then the thruster speeds."""
    return (*FREE_STATES, *element_states("thruster_speed", thruster_slots))


def _water_parameters(craft: Craft) -> Iterator[Variable]:
    yield parameter("gravity", "m/s2", craft.gravity, "gravitational acceleration", 0.0)
    yield parameter("water_density", "kg/m3", craft.water_density, "density of the water", 0.0)
    text = "volume of water that the submerged vehicle displaces"
    yield parameter("displaced_volume", "m3", craft.displaced_volume, text, 0.0)
    centre, text = craft.centre_of_buoyancy, "centre of this volume"
    yield from vector_parameters("centre_of_buoyancy", "m", centre, text)
    text = "edge of the box of this volume"
    yield from vector_parameters("hull_size", "m", craft.size, text, 0.0)
    for name, text in MATRICES.items():
        yield matrix_parameter(name, f"{text}, for u, v, w, p, q, r", getattr(craft, name))


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


def _thruster_parameters(craft: Craft, slots: int) -> Iterator[Variable]:
    yield from element_parameters("thruster", craft.thrusters, _THRUSTER_COLUMNS, slots)
    limit = craft.max_thruster_speed
    yield parameter("max_thruster_speed", "rad/s", limit, "largest magnitude of the speeds", 0.0)
    yield parameter("thruster_radius", "m", craft.thruster_radius, "radius of the propellers", 0.0)
    lag, text = craft.thruster_time_constant, "time constant of the thruster speeds; 0: no lag"
    yield parameter("thruster_time_constant", "s", lag, text, 0.0)
    text = "loss of thrust over speed and axial velocity of the water"
    yield parameter("advance_coefficient", "kg/rad", craft.advance_coefficient, text, 0.0)


def _thruster_speed_variable(craft: Craft, slots: int) -> Variable:
    labels = element_labels([thruster.label for thruster in craft.thrusters], slots, str(slots))
    limit = f"{craft.max_thruster_speed:.4g}"
    text = f"commanded thruster speeds ({labels}), limited to -{limit} ... {limit} rad/s"
    return element_commands("thruster_speed", "rad/s", text, slots)
