"""How the variables of a block appear in an FMU: which value reference, where in memory, and whether the block is sound."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

from ...core import units
from ...core.component import Variable
from ...core.errors import InputError, Problem, did_you_mean
from .block import Block, BlockVariable

C_TYPES = {"Float64": "double", "Int32": "int32_t", "Boolean": "bool", "Enumeration": "int32_t"}
CAUSALITIES = ("parameter", "calculatedParameter", "input", "output", "local")
_DEFAULT_START = {"Float64": 0.0, "Int32": 0, "Boolean": False, "Enumeration": 1}


class TableRow(NamedTuple):
    """One row of the table of variables; its value reference is its position. `element` counts within the array `member`."""

    variable: BlockVariable
    element: int = 0


def variable_table(block: Block, fmi_version: int) -> list[TableRow]:
    """The variables as an FMI version sees them: FMI 2.0 has a scalar for each element of an array."""
    if fmi_version == 3:
        return [TableRow(variable) for variable in block.variables]
    return [row for variable in block.variables for row in _scalar_rows(variable)]


def _scalar_rows(variable: BlockVariable) -> Iterator[TableRow]:
    names = Variable(variable.name, shape=variable.shape).scalar_names
    for element, (name, start) in enumerate(zip(names, start_values(variable), strict=True)):
        yield TableRow(replace(variable, name=name, shape=(), start=start), element)


def start_values(variable: BlockVariable) -> tuple[Any, ...]:
    """The start values of all elements; zero, false or the first literal where the block gives none."""
    if variable.start is None:
        return (_DEFAULT_START[variable.type],) * math.prod(variable.shape)
    return variable.start if isinstance(variable.start, tuple) else (variable.start,)


def c_variable_table(block: Block, fmi_version: int) -> str:
    """The C table of variables that the shell reads (`variables.h`), without the FMU's token."""
    entries = [_c_row(row, fmi_version) for row in variable_table(block, fmi_version)]
    if fmi_version == 3:
        entries.insert(0, '{"time", FLOAT64, READ_ONLY, offsetof(State, time), 1, 0}')
    lines = "".join(f"    {entry},\n" for entry in entries)
    comment = "/* The variables of this FMU in the order of their value references. */"
    return f"{comment}\nstatic const Variable VARIABLES[] = {{\n{lines}}};\n"


def _c_row(row: TableRow, fmi_version: int) -> str:
    variable = row.variable
    # FMI 2.0 reads and writes enumerations as integers
    kind = "Int32" if fmi_version == 2 and variable.type == "Enumeration" else variable.type
    offset = f"offsetof(State, model.{variable.member})"
    if row.element:
        offset += f" + {row.element} * sizeof({C_TYPES[variable.type]})"
    name = json.dumps(variable.name, ensure_ascii=False)
    return f"{{{name}, {kind.upper()}, {_c_role(variable)}, {offset}, {math.prod(variable.shape)}, {len(variable.enumeration)}}}"


def _c_role(variable: BlockVariable) -> str:
    if variable.causality == "parameter":
        return "TUNABLE_PARAMETER" if variable.variability == "tunable" else "FIXED_PARAMETER"
    return "INPUT" if variable.causality == "input" else "READ_ONLY"


def check_block(block: Block) -> None:
    """Raises InputError with everything that keeps a block from becoming a valid FMU."""
    problems = [] if block.identifier.isidentifier() else [f'"{block.identifier}" is no C identifier']
    if not block.variables:
        problems.append("has no variables")
    counts = Counter(["time", *(variable.name for variable in block.variables)])
    problems += [f'variable name "{name}" is used {count} times' for name, count in counts.items() if count > 1]
    for variable in block.variables:
        problems += [f'variable "{variable.name}": {problem}' for problem in _variable_problems(variable)]
    if problems:
        raise InputError([Problem(problem, block.identifier) for problem in problems])


def _variable_problems(variable: BlockVariable) -> Iterator[str]:
    if variable.type not in C_TYPES:
        yield f'unknown type "{variable.type}"{did_you_mean(variable.type, C_TYPES)}'
        return
    if variable.causality not in CAUSALITIES:
        yield f'unknown causality "{variable.causality}"{did_you_mean(variable.causality, CAUSALITIES)}'
    if variable.type != "Float64" and variable.variability == "continuous":
        yield f"type {variable.type} cannot be continuous"
    if variable.type == "Enumeration" and not variable.enumeration:
        yield "the enumeration has no literals"
    found, expected = len(start_values(variable)), math.prod(variable.shape)
    if found != expected:
        yield f"found {found} start values, expected {expected}"
    try:
        units.parse_unit(variable.unit or "1")
    except ValueError as error:
        yield str(error)
