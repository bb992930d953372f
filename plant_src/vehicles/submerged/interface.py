"""Variables of a submerged vehicle, in the order of the equations.

The arrays of the thrusters have as many elements as the vehicle has thrusters, or more: the
equations of all submerged vehicles in a world are compiled once, for MAX_THRUSTERS thrusters.
Elements without a thruster are 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cosim.core.component import Variable
from cosim.core.units import parse_unit

from ..common.inertia import inertia_variables
from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WORLD_OUTPUTS,
    element_labels,
    initial_variables,
    scalar_variable,
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
    return (*FREE_STATES, *(f"thruster_speed[{number}]" for number in range(1, thruster_slots + 1)))


def _water_parameters(craft: Craft) -> Iterator[Variable]:
    yield _parameter("gravity", "m/s2", "gravitational acceleration", craft.gravity, 0.0)
    yield _parameter("water_density", "kg/m3", "density of the water", craft.water_density, 0.0)
    text = "volume of water that the submerged vehicle displaces"
    yield _parameter("displaced_volume", "m3", text, craft.displaced_volume, 0.0)
    for axis, value in zip("xyz", craft.centre_of_buoyancy, strict=True):
        yield _parameter(
            f"centre_of_buoyancy.{axis}", "m", f"centre of this volume: {axis}, body frame", value
        )
    for axis, value in zip("xyz", craft.size, strict=True):
        yield _parameter(
            f"hull_size.{axis}",
            "m",
            f"edge of the box of this volume: {axis}, body frame",
            value,
            0.0,
        )
    for name, text in MATRICES.items():
        start = tuple(np.ravel(getattr(craft, name)).tolist())
        text = f"{text}, for u, v, w, p, q, r, SI units"
        yield Variable(name, "Float64", "parameter", "fixed", start, parse_unit("1"), (6, 6), text)


def _thruster_parameters(craft: Craft, slots: int) -> Iterator[Variable]:
    thrusters = craft.thrusters
    for name, unit, text in (
        ("position", "m", "centres of the propellers"),
        ("axis", "1", "unit vectors of the thrusts"),
    ):
        for k, axis in enumerate("xyz"):
            values = [getattr(thruster, name)[k] for thruster in thrusters]
            yield _thruster_array(
                f"thruster_{name}.{axis}", unit, f"{text}: {axis}, body frame", values, slots
            )
    for name, unit, text in (
        ("thrust_coefficient", "N.s2/rad2", "thrust over squared speed at positive speeds"),
        ("reverse_thrust_coefficient", "N.s2/rad2", "thrust over squared speed at negative speeds"),
        (
            "torque_coefficient",
            "N.m.s2/rad2",
            "reaction torque on the body about the axis over squared speed",
        ),
    ):
        yield _thruster_array(
            name, unit, text, [getattr(thruster, name) for thruster in thrusters], slots
        )
    yield _parameter(
        "max_thruster_speed",
        "rad/s",
        "largest magnitude of the speeds",
        craft.max_thruster_speed,
        0.0,
    )
    yield _parameter("thruster_radius", "m", "radius of the propellers", craft.thruster_radius, 0.0)
    lag = craft.thruster_time_constant
    yield _parameter(
        "thruster_time_constant", "s", "time constant of the thruster speeds; 0: no lag", lag, 0.0
    )
    text = "loss of thrust over speed and axial velocity of the water"
    yield _parameter("advance_coefficient", "kg/rad", text, craft.advance_coefficient, 0.0)


def _thruster_array(
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
        f"thrusters: {description}",
    )


def _thruster_speed_variable(craft: Craft, slots: int) -> Variable:
    labels = element_labels([thruster.label for thruster in craft.thrusters], slots, str(slots))
    limit = f"{craft.max_thruster_speed:.4g}"
    text = f"commanded thruster speeds ({labels}), limited to -{limit} ... {limit} rad/s"
    unit, start = parse_unit("rad/s"), (0.0,) * slots
    return Variable(
        "thruster_speed",
        "Float64",
        "input",
        start=start,
        unit=unit,
        shape=(slots,),
        description=text,
    )


def _parameter(
    name: str, unit: str, description: str, start: float, minimum: float | None = None
) -> Variable:
    return replace(scalar_variable(name, unit, description, "parameter", start), minimum=minimum)
