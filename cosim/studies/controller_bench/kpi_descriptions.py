"""Descriptions of KPI values from the docstrings of their functions, which are parsed but not executed."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from ...scenario.evaluation_schema import FunctionSpec
from ...scenario.function_definitions import function_definition
from ...scenario.named_functions import definition_problem

#: item of a docstring's list of values, such as "- `time[1]`, `time[2]`, ...: time of each (s)",
#: with its continuation lines
_ITEM = re.compile(
    r"^ *- ((?:`[\w\[\]]+`(?:, )?)+)(?:\.\.\.)?: (.+(?:\n +(?!- )\S.*)*)", re.MULTILINE
)
_NAME = re.compile(r"`(\w+)")


def describe_kpis(kpis: Iterable[Mapping[str, Any]], folder: Path) -> dict[str, str]:
    """Return the meaning of the KPI values of a scenario by name without indices.

    A KPI's own name has the first line of the docstring and the arguments, for values that the
    docstring does not list.

    Args:
        kpis: the KPIs as in the scenario.
        folder: folder from which the paths of their functions start.
    """
    found: dict[str, str] = {}
    for spec in map(FunctionSpec.model_validate, kpis):
        text = (
            ""
            if definition_problem(spec, folder)
            else ast.get_docstring(function_definition(spec, folder)) or ""
        )
        found |= {
            f"{spec.name}.{value}": meaning for value, meaning in _value_meanings(text).items()
        }
        if text:
            found[spec.name] = _function_meaning(text.partition("\n")[0], spec.arguments)
    return found


def kpi_description(name: str, descriptions: Mapping[str, str]) -> str:
    """Return the meaning of a KPI value such as "waypoints.time[1]"; "" if it is not known."""
    base = name.partition("[")[0]
    return descriptions.get(base) or descriptions.get(base.partition(".")[0], "")


def _value_meanings(docstring: str) -> dict[str, str]:
    items = (
        (names, " ".join(text.replace("`", "").split())) for names, text in _ITEM.findall(docstring)
    )
    return {name: text for names, text in items for name in _NAME.findall(names)}


def _function_meaning(first_line: str, arguments: Mapping[str, Any]) -> str:
    """Return a line such as "the mean of the error over time (signal plant.uav.position.z, start 15.0)"."""
    line = re.sub(r"^(Return|Evaluate) ", "", first_line.replace("`", "")).rstrip(".")
    settings = ", ".join(f"{name} {value}" for name, value in arguments.items())
    return f"{line} ({settings})" if settings else line
