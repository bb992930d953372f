"""Constants of the vehicles in a world: parameters as variables, and limits of the commands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from cosim.core.component import DTYPES, Variable

from .physics.body import ContactBody
from .variable_views import variable_views
from .vehicles.otter.parameters import MAX_PROPELLER_SPEED, MIN_PROPELLER_SPEED
from .world_settings import INITIAL_PREFIX, WAVE_PREFIX

#: command -> parameters with the magnitude of its lower limit ("": the limit is 0) and with its
#: upper limit
_PARAMETERS = {
    "rotor_speed": ("", "max_rotor_speed"),
    "thruster_speed": ("max_thruster_speed", "max_thruster_speed"),
    "propeller_speed": ("max_reverse_speed", "max_propeller_speed"),
    "azimuth": ("max_azimuth", "max_azimuth"),
    "rudder_angle": ("max_rudder_angle", "max_rudder_angle"),
}
#: limits of commands for which a model has no parameter; a rudder beyond a right angle is in the
#: wrong unit
_FIXED = {
    "propeller_speed": (MIN_PROPELLER_SPEED, MAX_PROPELLER_SPEED),
    "rudder_angle": (-math.pi / 2, math.pi / 2),
}


def vehicle_constants(body: ContactBody, pointer: str) -> Iterator[tuple[Variable, np.ndarray]]:
    """Yield the parameters of a vehicle, except those of initial state and waves, as constants that `pointer` sets."""
    for variable, values in variable_views(
        body.model.real_variables("parameter"), {DTYPES["Float64"]: body.parameters}
    ):
        if not variable.name.startswith((INITIAL_PREFIX, WAVE_PREFIX)):
            value = values.tolist() if variable.shape else values.item()
            name = f"{body.name}.{variable.name}"
            text = f"{variable.description}; set by {pointer}/{variable.name}"
            constant = replace(
                variable,
                name=name,
                causality="local",
                variability="constant",
                start=value,
                description=text,
            )
            yield constant, values


def input_limits(body: ContactBody) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the name of each limited scalar input of a vehicle, and its lower and upper limit in the unit of the input.

    Inputs without an actuator, such as the angle of a fixed rudder, are left out.
    """
    parameters = dict(zip(body.model.slots("parameter"), body.parameters.tolist(), strict=True))
    for variable in body.model.real_variables("input"):
        if variable.name in _PARAMETERS:
            for scalar in variable.scalar_names:
                low, high = _limits(variable.name, scalar.removeprefix(variable.name), parameters)
                if low < high:
                    yield f"{body.name}.{scalar}", (low, high)


def _limits(command: str, subscript: str, parameters: Mapping[str, float]) -> tuple[float, float]:
    lower, upper = (
        parameters.get(name + subscript, parameters.get(name)) for name in _PARAMETERS[command]
    )
    return _FIXED[command] if upper is None else (0.0 - (lower or 0.0), upper)
