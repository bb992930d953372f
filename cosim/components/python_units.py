"""Units of the variables of a PythonFMU class, from its attribute `units`."""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections import defaultdict
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem, abbreviate_names
from ..core.units import parse_unit


def checked_units(
    units: Any, types: Mapping[str, str], owner: type | None = None
) -> Mapping[str, str]:
    """Return the attribute `units` of a PythonFMU class, such as `{"rudder_angle": "rad"}`, after a check.

    Args:
        units: Value of the attribute.
        types: FMI 3.0 type of each variable of the class.
        owner: The class, for messages.

    Raises:
        InputError: The attribute is not a dict of texts, names a variable that does not exist or is not of type Real, or contains
            an unknown unit.
    """
    if not isinstance(units, Mapping) or not all(
        isinstance(text, str) for item in units.items() for text in item
    ):
        raise _refusal(owner, "is not a dict of names of variables and units")
    numbers = [name for name, kind in types.items() if kind == "Float64"]
    names_by_fault: dict[str, list[str]] = defaultdict(list)
    for name, unit in units.items():
        if fault := _find_fault(name, unit, numbers):
            names_by_fault[fault].append(f'"{name}"')
    if names_by_fault:
        raise _refusal(
            owner,
            *(
                fault.format(names=abbreviate_names(names, 4))
                for fault, names in names_by_fault.items()
            ),
        )
    return units


def units_place(owner: type) -> str:
    """Return the attribute `units` with the class that defines it, its file and line, as far as they are known."""
    kind = next((each for each in owner.__mro__ if "units" in vars(each)), owner)
    try:
        lines, first = inspect.getsourcelines(kind)
        (definition,) = ast.parse(textwrap.dedent("".join(lines))).body
        file = Path(inspect.getfile(kind)).name
    except (OSError, TypeError, ValueError, SyntaxError):
        return f"{kind.__name__}.units"
    names = ((node.lineno, ast.unparse(node)) for node in getattr(definition, "body", ()))
    line = next(
        (number for number, text in names if text.partition(" ")[0].rstrip(":") == "units"), 1
    )
    return f"{kind.__name__}.units ({file}:{first + line - 1})"


def _refusal(owner: type | None, *faults: str) -> InputError:
    attribute = (
        f"the class attribute {units_place(owner)}" if owner else 'the class attribute "units"'
    )
    return InputError([Problem(f"{attribute} {fault}") for fault in faults])


def _find_fault(name: str, unit: str, numbers: Collection[str]) -> str:
    """Return the fault of an entry, with "{names}" in place of its variable.

    "" if there is none.
    """
    if name not in numbers:
        registered = abbreviate_names(numbers) or "none"
        return (
            "names {names}, but no register_variable of type Real does; registered: "
            f"{_escaped(registered)}"
        )
    try:
        parse_unit(unit)
    except ValueError as error:
        return f'contains "{_escaped(unit)}" for {{names}}: {_escaped(str(error))}'
    return ""


def _escaped(text: str) -> str:
    return text.replace("{", "{{").replace("}", "}}")
