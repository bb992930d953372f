"""Declarations of variables and checks of arguments that sensors share."""

from __future__ import annotations

import math
from typing import Any

from cosim.core.component import Causality, Variability, Variable
from cosim.core.errors import InputError
from cosim.core.units import parse_unit

from ..json_reader import JsonReader


def check_seed(reader: JsonReader, seed: Any) -> None:
    """Add a problem to `reader` unless `seed` is an integer from 0 to 2^31 - 1."""
    reader.integer(seed, ("seed",), 0, 2**31 - 1)


def raise_problems(reader: JsonReader) -> None:
    """Raise InputError with all problems that `reader` has collected, if there are any."""
    if reader.problems:
        raise InputError(reader.problems)


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
    axes: str,
    unit: str,
    causality: Causality,
    start: float | None = None,
    text: str = "",
) -> list[Variable]:
    """Declare the real variables `name.AXIS`, one for each letter of `axes`."""
    return [
        real_variable(f"{name}.{axis}", unit, causality, start, f"{text}: {axis}" if text else "")
        for axis in axes
    ]


def real_parameter(
    name: str,
    unit: str,
    start: Any,
    description: str,
    minimum: float | None = 0.0,
    maximum: float | None = None,
) -> Variable:
    """Declare a tunable real parameter; its default minimum is 0."""
    return real_variable(
        name, unit, "parameter", start, description, minimum=minimum, maximum=maximum
    )


def seed_parameter(seed: int) -> Variable:
    """Declare the parameter `seed`.

    Raises InputError if `seed` is not an integer from 0 to 2^31 - 1.
    """
    reader = JsonReader()
    check_seed(reader, seed)
    raise_problems(reader)
    return Variable(
        "seed", "Int32", "parameter", "fixed", seed, description="of all random numbers", minimum=0
    )


def boolean_variable(
    name: str, causality: Causality, description: str, start: bool | None = None
) -> Variable:
    """Declare a Boolean variable: a tunable parameter or a discrete output."""
    kind: Variability = "tunable" if causality == "parameter" else "discrete"
    return Variable(name, "Boolean", causality, kind, start, description=description)


def pose_inputs(name: str, position: str = "position") -> list[Variable]:
    """Declare the inputs of a pose.

    Args:
        name: Prefix of the inputs.
        position: Name of the position below the prefix.

    Returns:
        `name.position.x|y|z` (m, world) and `name.orientation.w|x|y|z` (unit quaternion, body to
        world), 7 scalars.
    """
    orientation = [
        real_variable(f"{name}.orientation.{part}", "1", "input", float(part == "w"))
        for part in "wxyz"
    ]
    return [*vector_variables(f"{name}.{position}", "xyz", "m", "input"), *orientation]
