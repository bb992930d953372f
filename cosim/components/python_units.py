"""Units of the variables of a PythonFMU class, from its attribute `units`."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

from ..core.errors import InputError, Problem, abbreviate_names
from ..core.units import parse_unit


def checked_units(units: Any, types: Mapping[str, str]) -> Mapping[str, str]:
    """Return the attribute `units` of a PythonFMU class, such as `{"rudder_angle": "rad"}`, after a check.

    Args:
        units: Value of the attribute.
        types: FMI 3.0 type of each variable of the class.

    Raises:
        InputError: The attribute is not a dict of texts, names a variable that does not exist or is not of type Real, or contains
            an unknown unit.
    """
    if not isinstance(units, Mapping) or not all(isinstance(text, str) for item in units.items() for text in item):
        raise InputError('the class attribute "units" is not a dict of names of variables and units')
    numbers = [name for name, kind in types.items() if kind == "Float64"]
    problems = [problem for name, unit in units.items() if (problem := _find_problem(name, unit, numbers))]
    if problems:
        raise InputError([Problem(f'the class attribute "units" {problem}') for problem in problems])
    return units


def _find_problem(name: str, unit: str, numbers: Collection[str]) -> str:
    if name not in numbers:
        registered = abbreviate_names(numbers) or "none"
        return f'names "{name}", but no register_variable of type Real does; registered: {registered}'
    try:
        parse_unit(unit)
    except ValueError as error:
        return f'contains "{unit}" for "{name}": {error}'
    return ""
