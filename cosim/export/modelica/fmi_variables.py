"""FMI variables of a Modelica model: causality, variability, start value and unit."""

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.component import Causality, Variability
from ...core.errors import InputError, Problem, abbreviate_names
from ...core.units import parse_unit
from ..fmu.block import BlockVariable
from .c_code.header import struct_members
from .causality.analysed_model import AnalysedModel
from .model.flat_model import Model, Variable, is_input
from .model.syntax_tree import raise_model_error

FmiRole = tuple[Causality, Variability]


def check_units(variables: Sequence[tuple[Variable, FmiRole]]) -> set[str]:
    """Return the unknown units, for example "dB", and log a warning of each.

    The FMU cannot state them.

    Args:
        variables: The FMI variables with their roles.

    Raises:
        InputError: An input or output has an unknown unit.
    """
    unknown: dict[str, list[Variable]] = {}
    problems = []
    units = {variable.unit for variable, _ in variables} - {""}
    errors = {unit: _unit_error(unit) for unit in units}
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


FMI_TYPES = {
    "Real": "Float64",
    "Integer": "Int32",
    "Boolean": "Boolean",
    "Enumeration": "Enumeration",
}


def block_variables(analysed: AnalysedModel) -> list[BlockVariable]:
    """Return the variables of the FMU.

    Raises:
        InputError: An input or output has an unknown unit, or enumerations have the same name.
    """
    names = struct_members(analysed.model)
    roles = []
    for variable in analysed.model.variables.values():
        if role := _fmi_role(variable, analysed):
            roles.append((variable, role))
    dropped = check_units(roles)
    result = []
    for variable, role in roles:
        known = replace(variable, unit="") if variable.unit in dropped else variable
        result.append(_block_variable(known, names[variable.name], role, analysed))
    return result


def _fmi_role(variable: Variable, analysed: AnalysedModel) -> FmiRole | None:
    """Return causality and variability of a variable, or None if the FMU lacks it.

    The FMU contains the inputs and outputs of the model itself, and all parameters that are neither
    protected nor set by a modifier. Structural parameters are constants. The FMU of a model with
    states, event iteration or a library contains all other variables too.
    """
    roles = analysed.parameter_roles
    if variable.type == "ExternalObject":
        return None
    if variable.name in roles.settable:
        return "parameter", "fixed" if variable.name in roles.clock_parameters else "tunable"
    if variable.name in analysed.model.structural and not variable.protected:
        return "local", "constant"
    if variable.variability == "parameter":
        return (
            None
            if variable.protected or variable.bound_by_modifier
            else ("calculatedParameter", "tunable")
        )
    continuous = variable.type == "Real" and bool(
        analysed.model.states or not analysed.schedule.clocks
    )
    if is_input(variable):
        return "input", "continuous" if variable.type == "Real" else "discrete"
    if variable.causality == "output" and variable.top_level:
        return "output", "continuous" if continuous else "discrete"
    if (
        (analysed.model.hybrid or analysed.model.uses_library or analysed.model.states)
        and not variable.name.startswith(("$", "pre("))
        and 0 not in variable.shape
    ):
        return (
            "local",
            "continuous" if continuous and variable.variability == "continuous" else "discrete",
        )
    return None


def _block_variable(
    variable: Variable, member: str, role: FmiRole, analysed: AnalysedModel
) -> BlockVariable:
    return BlockVariable(
        name=variable.name,
        member=member,
        type=FMI_TYPES[variable.type],
        causality=role[0],
        variability=role[1],
        start=_to_python(analysed.values[variable.name]),
        unit=variable.unit,
        shape=variable.shape,
        description=variable.description,
        minimum=None
        if variable.minimum is None
        else float(np.min(analysed.evaluate(variable.minimum))),
        maximum=None
        if variable.maximum is None
        else float(np.max(analysed.evaluate(variable.maximum))),
        enumeration=tuple((literal, "") for literal in _literals(variable, analysed.model)),
        type_name=variable.enumeration,
        quantity=variable.quantity,
    )


def _literals(variable: Variable, model: Model) -> tuple[str, ...]:
    """Return the literals of a variable's enumeration type; the type name may lack the package."""
    name = variable.enumeration
    candidates = {
        literals
        for key, literals in model.enumerations.items()
        if name and f".{key}".endswith(f".{name}")
    }
    if len(candidates) > 1:
        raise_model_error(
            f'{variable.name}: several enumerations are named "{name}"; give them different names',
            variable.where,
        )
    return next(iter(candidates), ())


def _to_python(value: Any) -> Any:
    return tuple(value.ravel().tolist()) if isinstance(value, np.ndarray) else value
