"""Units of the FMI variables of a Modelica model."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from ...core.component import Causality, Variability
from ...core.errors import InputError, Problem, abbreviate_names
from ...core.units import parse_unit
from .model.flat_model import Variable

FmiRole = tuple[Causality, Variability]


def check_units(variables: Sequence[tuple[Variable, FmiRole]]) -> set[str]:
    """Return the unknown units, for example "dB", which the FMU cannot state, and log a warning of each.

    Args:
        variables: The FMI variables with their roles.

    Raises:
        InputError: An input or output has an unknown unit.
    """
    unknown: dict[str, list[Variable]] = {}
    problems = []
    errors = {
        unit: _unit_error(unit)
        for unit in {variable.unit for variable, _ in variables if variable.unit}
    }
    for variable, (causality, _) in variables:
        error = errors.get(variable.unit)
        if error and causality in ("input", "output"):
            problems.append(Problem(f"{variable.name}: {error}", str(variable.where or "")))
        elif error:
            unknown.setdefault(variable.unit, []).append(variable)
    if problems:
        raise InputError(problems)
    for unit, users in unknown.items():
        names = abbreviate_names((variable.name for variable in users), 4)
        text = f"{names}: the FMU states no unit: {errors[unit]}"
        logging.getLogger("cosim.export").warning("%s", Problem(text, str(users[0].where or "")))
    return set(unknown)


def _unit_error(unit: str) -> str:
    try:
        parse_unit(unit)
    except ValueError as error:
        return str(error)
    return ""
