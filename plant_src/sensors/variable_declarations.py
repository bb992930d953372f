"""Declarations of variables and checks of arguments that sensors share."""

import math
from collections.abc import Sequence
from typing import Any

from cosim.core.component import Causality, Variability, Variable
from cosim.core.errors import InputError
from cosim.core.units import parse_unit

from ..json_reader import JsonReader, Numbers

EULER_ANGLES = ("roll", "pitch", "yaw")


def check_arguments(reader: JsonReader, seed: Any = 0) -> None:
    """Raise InputError with all problems that `reader` has collected, and that of `seed`.

    A seed is an integer from 0 to 2^31 - 1.
    """
    reader.integer(seed, ("seed",), 0, 2**31 - 1)
    if reader.problems:
        raise InputError(reader.problems)


def read_platforms(reader: JsonReader, platforms: Any) -> list[tuple[Numbers, Numbers]]:
    """Read edges and centre (m) of platforms, given as in the arguments of the plant."""
    boxes = []
    for name, spec in reader.read_named_objects(platforms, ("platforms",)).items():
        path = ("platforms", name)
        spec = reader.read_object(spec, path, ("size", "position"), ())
        size, position = (
            reader.vector(spec.get(key, [1.0] * 3), (*path, key), "xyz")
            for key in ("size", "position")
        )
        boxes.append((size, position))
    return boxes


def real_variable(
    name: str,
    unit: str,
    causality: Causality,
    start: Any = None,
    description: str = "",
    *,
    shape: tuple[int, ...] = (),
    minimum: float | None = None,
    maximum: float | None = None,
    variability: Variability | None = None,
) -> Variable:
    """Declare a real variable.

    Args:
        name: Name of the variable.
        unit: Unit in Modelica syntax, "" for none.
        causality: FMI causality.
        start: Start value; inputs start at zero by default.
        description: Description of the variable.
        shape: Shape of an array, () for a scalar.
        minimum: Smallest valid value.
        maximum: Largest valid value.
        variability: FMI variability; by default parameters are tunable, other variables continuous.

    Returns:
        The variable.
    """
    default: Variability = "tunable" if causality == "parameter" else "continuous"
    if start is None and causality == "input":
        start = (0.0,) * math.prod(shape) if shape else 0.0
    parsed = parse_unit(unit) if unit else None
    return Variable(
        name,
        "Float64",
        causality,
        variability or default,
        start,
        parsed,
        shape,
        description,
        minimum,
        maximum,
    )


def vector_variables(
    name: str,
    axes: Sequence[str],
    unit: str,
    causality: Causality,
    text: str = "",
) -> list[Variable]:
    """Declare the real variables `name.AXIS`, one for each of `axes`."""
    return [
        real_variable(f"{name}.{axis}", unit, causality, None, f"{text}: {axis}" if text else "")
        for axis in axes
    ]


def real_parameter(
    name: str,
    unit: str,
    start: float,
    description: str,
    minimum: float | None = 0.0,
    maximum: float | None = None,
) -> Variable:
    """Declare a tunable real parameter; its default minimum is 0."""
    return real_variable(
        name, unit, "parameter", start, description, minimum=minimum, maximum=maximum
    )


def share_parameter(name: str, start: float, description: str) -> Variable:
    """Declare a tunable parameter from 0 to 1."""
    return real_parameter(name, "1", start, description, 0.0, 1.0)


def array_parameter(name: str, unit: str, start: tuple[float, ...], description: str) -> Variable:
    """Declare a tunable parameter that is an array of as many elements as `start` has."""
    return real_variable(name, unit, "parameter", start, description, shape=(len(start),))


def seed_parameter(seed: int) -> Variable:
    """Declare the parameter `seed`.

    Raises InputError if `seed` is not an integer from 0 to 2^31 - 1.
    """
    check_arguments(JsonReader(), seed)
    return Variable(
        "seed", "Int32", "parameter", "fixed", seed, description="of all random numbers", minimum=0
    )


def boolean_variable(
    name: str, causality: Causality, description: str, start: bool | None = None
) -> Variable:
    """Declare a Boolean variable: a tunable parameter or a discrete output."""
    kind: Variability = "tunable" if causality == "parameter" else "discrete"
    return Variable(name, "Boolean", causality, kind, start, description=description)


def orientation_inputs(name: str) -> list[Variable]:
    """Declare the inputs `name.orientation.w|x|y|z` (unit quaternion, body to world)."""
    return [
        real_variable(f"{name}.orientation.{part}", "1", "input", float(part == "w"))
        for part in "wxyz"
    ]


def pose_inputs(name: str, position: str = "position") -> list[Variable]:
    """Declare the inputs of a pose.

    Args:
        name: Prefix of the inputs.
        position: Name of the position below the prefix.

    Returns:
        `name.position.x|y|z` (m, world) and `name.orientation.w|x|y|z` (unit quaternion, body to
        world), 7 scalars.
    """
    return [*vector_variables(f"{name}.{position}", "xyz", "m", "input"), *orientation_inputs(name)]
