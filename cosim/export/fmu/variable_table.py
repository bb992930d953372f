"""Variables of a block in an FMU: value references, memory offsets and validation of the block."""

import json
import math
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import Any, NamedTuple

from ...core import units
from ...core.component import Variable
from ...core.errors import InputError, Problem, did_you_mean
from ...core.text import count_noun
from .block import Block, BlockVariable

C_TYPES = {"Float64": "double", "Int32": "int32_t", "Boolean": "bool", "Enumeration": "int32_t"}
CAUSALITIES = ("parameter", "calculatedParameter", "input", "output", "local")
_DEFAULT_START = {"Float64": 0.0, "Int32": 0, "Boolean": False, "Enumeration": 1}


class TableRow(NamedTuple):
    """A row of the table of variables.

    Its index is the value reference in FMI 2.0 and the value reference - 1 in FMI 3.0.
    """

    variable: BlockVariable
    #: index of the element in the array `variable.member`
    element: int = 0


def variable_table(block: Block, fmi_version: int) -> list[TableRow]:
    """Return the table of variables for an FMI version.

    In FMI 2.0 each element of an array is a scalar variable. In FMI 3.0 event indicators are
    variables.
    """
    if fmi_version == 3:
        indicators = block.exchange.indicators if block.exchange else ()
        return [TableRow(variable) for variable in (*block.variables, *indicators)]
    return list(chain.from_iterable(map(_scalar_rows, block.variables)))


def _scalar_rows(variable: BlockVariable) -> Iterator[TableRow]:
    inner = (
        variable.name.removeprefix("der(").removesuffix(")")
        if variable.name.startswith("der(")
        else ""
    )
    names = Variable(inner or variable.name, shape=variable.shape).scalar_names
    for element, (scalar, start) in enumerate(zip(names, start_values(variable), strict=True)):
        name = f"der({scalar})" if inner else scalar
        yield TableRow(replace(variable, name=name, shape=(), start=start), element)


def start_values(variable: BlockVariable) -> tuple[Any, ...]:
    """Return the start values of all elements; the default is zero, false or the first literal."""
    if variable.start is None:
        return (_DEFAULT_START[variable.type],) * math.prod(variable.shape)
    return variable.start if isinstance(variable.start, tuple) else (variable.start,)


def c_variable_table(block: Block, fmi_version: int) -> str:
    """Return the text of `variables.h`, the table of variables for the shell, without the token."""
    entries = [_c_row(row, fmi_version) for row in variable_table(block, fmi_version)]
    if fmi_version == 3:
        entries.insert(0, '{"time", FLOAT64, READ_ONLY, offsetof(State, time), 1, 0}')
    lines = "".join(f"    {entry},\n" for entry in entries)
    comment = "/* The variables of this FMU in the order of their value references. */"
    return f"{comment}\nstatic const Variable VARIABLES[] = {{\n{lines}}};\n"


def _c_row(row: TableRow, fmi_version: int) -> str:
    variable = row.variable
    # FMI 2.0 reads and writes enumerations by the functions for Integer
    type_name = "Int32" if fmi_version == 2 and variable.type == "Enumeration" else variable.type
    offset = f"offsetof(State, model.{variable.member})"
    if row.element:
        offset += f" + {row.element} * sizeof({C_TYPES[variable.type]})"
    name = json.dumps(variable.name, ensure_ascii=False)
    count, literals = math.prod(variable.shape), len(variable.enumeration)
    return f"{{{name}, {type_name.upper()}, {_c_role(variable)}, {offset}, {count}, {literals}}}"


def _c_role(variable: BlockVariable) -> str:
    if variable.causality == "parameter":
        return "TUNABLE_PARAMETER" if variable.variability == "tunable" else "FIXED_PARAMETER"
    return "INPUT" if variable.causality == "input" else "READ_ONLY"


def check_block(block: Block) -> None:
    """Check that a block can be exported as a valid FMU.

    Raises:
        InputError: The block has faults (one problem for each).
    """
    problems = (
        [] if block.identifier.isidentifier() else [f'"{block.identifier}" is not a C identifier']
    )
    if not block.variables:
        problems.append("has no variables")
    counts = Counter(["time", *(variable.name for variable in block.variables)])
    problems += [
        f'the variable name "{name}" is used {count} times'
        for name, count in counts.items()
        if count > 1
    ]
    for variable in block.variables:
        problems += [
            f'variable "{variable.name}": {problem}' for problem in _variable_problems(variable)
        ]
    if problems:
        raise InputError([Problem(problem, block.identifier) for problem in problems])


def _variable_problems(variable: BlockVariable) -> Iterator[str]:
    if variable.type not in C_TYPES:
        yield f'unknown type "{variable.type}"{did_you_mean(variable.type, C_TYPES)}'
        return
    if variable.causality not in CAUSALITIES:
        yield (
            "unknown causality "
            f'"{variable.causality}"{did_you_mean(variable.causality, CAUSALITIES)}'
        )
    if variable.type != "Float64" and variable.variability == "continuous":
        yield f"found variability continuous for the type {variable.type}, expected discrete"
    if variable.type == "Enumeration" and not variable.enumeration:
        yield "the enumeration has no literals"
    found, expected = len(start_values(variable)), math.prod(variable.shape)
    if found != expected:
        yield f"found {count_noun(found, 'start value')}, expected {expected}"
    try:
        units.parse_unit(variable.unit or "1")
    except ValueError as error:
        yield str(error)
