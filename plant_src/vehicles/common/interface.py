"""Variables that vehicles have in common: names, units and order, for the plant FMUs and the world.

World frame: x east, y north, z up. Body frame: x forward, y left, z up, origin at the centre of
mass. Rotations follow the right-hand rule: positive roll lifts the left side, positive pitch lowers
the nose, positive yaw is counter-clockwise from above.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from cosim.core.component import Causality, Variability, Variable
from cosim.core.units import parse_unit

from .shapes import INERTIA_INDICES

#: status codes of a predicted step, which the compiled equations report before anything has moved:
#: valid; the vehicle leaves the box in which it cannot meet anything; an input or the state is not
#: finite, or too large. LEAVES_SAFE_BOX and MAY_FAIL are added if both apply.
VALID, LEAVES_SAFE_BOX, INVALID_STATE = 0.0, 1.0, 2.0

#: the vehicle ends upside down, or a multirotor where the water surface may be
MAY_FAIL = 4.0

#: norm of the state (m, m/s, rad, rad/s) from which the motion counts as diverged
MAX_STATE_NORM = 1e5


def vector_variables(
    name: str, axes: Sequence[str], unit: str, description: str, causality: Causality = "output"
) -> tuple[Variable, ...]:
    """Return real scalar variables `name.axis`, one for each axis.

    Inputs and parameters start at 0.
    """
    variability: Variability = "fixed" if causality == "parameter" else "continuous"
    start = None if causality == "output" else 0.0
    return tuple(
        Variable(
            f"{name}.{axis}",
            "Float64",
            causality,
            variability,
            start,
            parse_unit(unit),
            description=f"{description}: {axis}",
        )
        for axis in axes
    )


def scalar_variable(
    name: str, unit: str, description: str, causality: Causality = "input", start: float = 0.0
) -> Variable:
    """Return a real scalar variable."""
    variability: Variability = "fixed" if causality == "parameter" else "continuous"
    return Variable(
        name, "Float64", causality, variability, start, parse_unit(unit), description=description
    )


def parameter(
    name: str,
    unit: str,
    start: Any,
    description: str,
    minimum: float | None = None,
    maximum: float | None = None,
    shape: tuple[int, ...] = (),
) -> Variable:
    """Return a real parameter with a range: a scalar, or an array with a shape."""
    return Variable(
        name,
        "Float64",
        "parameter",
        "fixed",
        start,
        parse_unit(unit),
        shape,
        description,
        minimum,
        maximum,
    )


def attribute_parameters(
    data: object, rows: Iterable[tuple[str, str, str, float | None, str]]
) -> Iterator[Variable]:
    """Yield a parameter for each of some attributes of vehicle data.

    An attribute is a number, or a vector along x, y and z of the body with a parameter for each
    component.

    Args:
        data: Vehicle data.
        rows: Attribute, and name, unit, smallest value and description of its parameter.
    """
    for attribute, name, unit, minimum, text in rows:
        value = getattr(data, attribute)
        if np.ndim(value):
            for axis, component in zip("xyz", value, strict=False):
                description = f"{text}: {axis}, body frame"
                yield parameter(f"{name}.{axis}", unit, float(component), description, minimum)
        else:
            yield parameter(name, unit, value, text, minimum)


def matrix_parameter(name: str, description: str, matrix: np.ndarray) -> Variable:
    """Return a parameter that is a matrix, in SI units."""
    start = tuple(np.ravel(matrix).tolist())
    return parameter(name, "1", start, f"{description}, SI units", shape=matrix.shape)


def element_parameters(
    kind: str, elements: Sequence[Any], columns: Iterable[tuple[str, str, str, str]], slots: int
) -> Iterator[Variable]:
    """Yield the arrays of the values of rotors, thrusters, propellers or rudders.

    Args:
        kind: Name of an element.
        elements: Data of the elements.
        columns: Attribute of an element, and name, unit and description of its parameter. The
            attributes "position" and "axis" are vectors, with an array for each component.
        slots: Number of elements of the arrays; those without data are 0.
    """
    empty = (0.0,) * (slots - len(elements))
    for attribute, name, unit, text in columns:
        values = [getattr(element, attribute) for element in elements]
        if attribute in ("position", "axis"):
            for k, axis in enumerate("xyz"):
                start = (*(value[k] for value in values), *empty)
                description = f"{kind}s: {text}: {axis}, body frame"
                yield parameter(f"{name}.{axis}", unit, start, description, shape=(slots,))
        else:
            start = (*map(float, values), *empty)
            yield parameter(name, unit, start, f"{kind}s: {text}", shape=(slots,))


def element_commands(name: str, unit: str, description: str, slots: int) -> Variable:
    """Return the input that commands an array of elements."""
    return Variable(
        name,
        "Float64",
        "input",
        start=(0.0,) * slots,
        unit=parse_unit(unit),
        shape=(slots,),
        description=description,
    )


def element_states(name: str, slots: int) -> tuple[str, ...]:
    """Return the names of the states of an array of elements."""
    return tuple(f"{name}[{number}]" for number in range(1, slots + 1))


EULER_ANGLES = ("roll", "pitch", "yaw")

#: motion of a vehicle
MOTION_OUTPUTS = (
    *vector_variables("position", "xyz", "m", "centre of mass, world frame"),
    *vector_variables("orientation", "wxyz", "1", "unit quaternion, body to world"),
    *vector_variables("attitude", EULER_ANGLES, "rad", "ZYX Euler angle"),
    *vector_variables("velocity", "xyz", "m/s", "centre of mass, world frame"),
    *vector_variables("velocity_body", "uvw", "m/s", "centre of mass, body frame"),
    *vector_variables("rates", "pqr", "rad/s", "angular velocity, body frame"),
)

#: motion of the landing deck of a vessel
DECK_OUTPUTS = (
    *vector_variables(
        "deck.position", "xyz", "m", "centre of the top of the landing deck, world frame"
    ),
    *vector_variables(
        "deck.velocity", "xyz", "m/s", "centre of the top of the landing deck, world frame"
    ),
)


def _flag(name: str, description: str) -> Variable:
    return Variable(name, "Boolean", "output", "discrete", description=description)


#: outputs that only a world computes: contact and failures; a plant FMU publishes 0 and false
WORLD_OUTPUTS = (
    Variable(
        "contact.force",
        "Float64",
        "output",
        unit=parse_unit("N"),
        description="sum of normal forces, mean over the step",
    ),
    _flag("contact.touching", "contact with anything"),
    _flag("contact.vessel", "contact with a vessel"),
    _flag("crashed", "collision above the crash speed or capsize; stays true"),
    _flag("ditched", "centre of mass below the water; stays true"),
)

#: all outputs of a vessel
VESSEL_OUTPUTS = (*MOTION_OUTPUTS, *DECK_OUTPUTS, *WORLD_OUTPUTS)


def inertia_variables(mass: float, inertia: np.ndarray, mass_text: str) -> tuple[Variable, ...]:
    """Return the parameters `mass` (kg) and `inertia.*` (kg m2, centre of mass, body frame)."""
    text = "inertia tensor about the centre of mass, body frame, rotors locked"
    tensor = (
        scalar_variable(name, "kg.m2", f"{text}: {name[-2:]}", "parameter", float(inertia[place]))
        for name, place in INERTIA_INDICES.items()
    )
    return (scalar_variable("mass", "kg", mass_text, "parameter", mass), *tensor)


#: external loads at the centre of mass
EXTERNAL_LOADS = (
    *vector_variables(
        "external_force", "xyz", "N", "force at the centre of mass, world frame", "input"
    ),
    *vector_variables("external_torque", "xyz", "N.m", "torque, world frame", "input"),
)

#: environment inputs, the last inputs of a model; in a world the environment writes them
WIND_INPUTS = vector_variables(
    "wind", "xyz", "m/s", "velocity of the air at the vehicle, world frame", "input"
)
CURRENT_INPUTS = vector_variables(
    "current", "xy", "m/s", "velocity of the water, world frame", "input"
)
WAVE_GAIN_INPUT = (
    scalar_variable("wave_gain", "1", "factor on the amplitudes of all waves", start=1.0),
)
#: the same of vessels in waves
FLOATING_INPUTS = (*WIND_INPUTS, *CURRENT_INPUTS, *WAVE_GAIN_INPUT)
GROUND_INPUTS = (
    scalar_variable(
        "ground_distance", "m", "height of the rotor centre above the surface below", start=1e3
    ),
    scalar_variable("ground_share", "1", "share of the rotors' area above this surface", start=1.0),
)
WATER_LEVEL_INPUT = (
    scalar_variable("water_level", "m", "height of the water surface, world frame", start=-1e9),
)
#: names of all environment inputs
ENVIRONMENT_INPUTS = frozenset(
    variable.name
    for variable in (
        *WIND_INPUTS,
        *CURRENT_INPUTS,
        *WAVE_GAIN_INPUT,
        *GROUND_INPUTS,
        *WATER_LEVEL_INPUT,
    )
)


#: upper limit of the number of wave components
MAX_WAVE_COMPONENTS = 64

#: elements of a row of the table of surfaces: half edges along forward and left (m), centre of the
#: top (m, world frame) and orientation (quaternion w, x, y, z) of a rectangle
SURFACE_COLUMNS = 9


def _wave_parameter(
    name: str, unit: str, description: str, minimum: float | None = None
) -> Variable:
    shape = (MAX_WAVE_COMPONENTS,)
    start = (0.0,) * MAX_WAVE_COMPONENTS
    return parameter(name, unit, start, description, minimum, shape=shape)


#: wave components; those after the first `wave.count` are not used
WAVE_PARAMETERS = (
    parameter("wave.count", "1", 0.0, "number of wave components", 0.0, float(MAX_WAVE_COMPONENTS)),
    _wave_parameter("wave.amplitude", "m", "amplitude of each wave component", 0.0),
    _wave_parameter("wave.frequency", "rad/s", "angular frequency of each wave component", 0.0),
    _wave_parameter(
        "wave.direction",
        "rad",
        "direction of propagation of each wave component, counter-clockwise from x",
    ),
    _wave_parameter("wave.phase", "rad", "phase of each wave component at the origin"),
)

#: states of a free rigid body: position and velocity in the world frame; actuator states follow
#: them
FREE_STATES = (
    *(f"position.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
    *(f"velocity.{axis}" for axis in "xyz"),
    *(f"rates.{axis}" for axis in "pqr"),
)

#: states of a vessel in the horizontal plane; actuator states follow them
PLANAR_STATES = (
    "position.x",
    "position.y",
    "attitude.yaw",
    "velocity_body.u",
    "velocity_body.v",
    "rates.r",
)

#: states of a vessel in six degrees of freedom; actuator states follow them
VESSEL_STATES = (
    *(f"origin.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
    *(f"velocity_body.{axis}" for axis in "uvw"),
    *(f"rates.{axis}" for axis in "pqr"),
    "time",
)

#: initial deviation of a floating vessel from its equilibrium
FLOATING_INITIAL_PARAMETERS = (
    scalar_variable(
        "initial.heave", "m", "initial height relative to the equilibrium", "parameter"
    ),
    scalar_variable(
        "initial.roll", "rad", "initial roll angle relative to the equilibrium", "parameter"
    ),
    scalar_variable(
        "initial.pitch", "rad", "initial pitch angle relative to the equilibrium", "parameter"
    ),
    scalar_variable(
        "initial.time", "s", "time of the waves at the start of the simulation", "parameter"
    ),
    parameter(
        "initial.on_waves",
        "1",
        1.0,
        "1: start on the waves and with their velocity; 0: as in still water",
        0.0,
        1.0,
    ),
)


def initial_variables(
    position_axes: str, velocity_axes: str, rate_axes: str
) -> tuple[Variable, ...]:
    """Return the parameters of the initial position, yaw angle, velocity and rates.

    Roll and pitch start at 0.
    """
    return (
        *vector_variables(
            "initial.position",
            position_axes,
            "m",
            "initial centre of mass, world frame",
            "parameter",
        ),
        scalar_variable("initial.yaw", "rad", "initial yaw angle", "parameter"),
        *vector_variables(
            "initial.velocity_body",
            velocity_axes,
            "m/s",
            "initial velocity, body frame",
            "parameter",
        ),
        *vector_variables(
            "initial.rates", rate_axes, "rad/s", "initial angular velocity, body frame", "parameter"
        ),
    )


def element_labels(labels: Sequence[str], slots: int, count: str) -> str:
    """Return the labels of all elements of an array.

    If it has more elements than labels, return which elements are in use.

    Args:
        labels: Place of each part in words.
        slots: Number of elements of the array.
        count: Name of the parameter that is the number of parts, or the largest number.

    >>> element_labels(["port", "starboard"], 2, "rudder_count")
    'port, starboard'
    >>> element_labels(["port", "starboard"], 16, "rudder_count")
    '1 to rudder_count'
    """
    return ", ".join(labels) if len(labels) == slots else f"1 to {count}"
