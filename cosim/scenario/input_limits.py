"""Values outside the limits of an input.

Probable causes, and warnings about values that a scenario or its caller sets.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from ..core.component import Variable
from ..core.errors import Problem
from ..core.system import Endpoint
from ..core.text import count_noun
from ..core.units import KNOWN_UNITS
from .assigned_values import iterate_assignments
from .name_resolution import UnknownNameError, resolve_name

if TYPE_CHECKING:
    from .prepared_run import PreparedRun

#: part of a limit by which a value may exceed it
_MARGIN = 0.01
#: unit of an input -> unit in which its value is often given by mistake, and smallest part of the
#: limit that makes it probable.
#: Commanded angles are often small, and the limit of a rudder without one of its own is a right
#: angle.
_CONFUSED_UNITS = {"rad/s": ("rpm", 1 / 3), "rad": ("deg", 1 / 8)}
#: largest part of the limit that makes another unit probable
_MAX_PART = 1.2


def outside(values: np.ndarray, limits: tuple[float, float]) -> np.ndarray:
    """Return the elements of `values` that are outside the limits by more than 1 %, as a Boolean array."""
    low, high = limits
    result: np.ndarray = (values < low - _MARGIN * abs(low)) | (values > high + _MARGIN * abs(high))
    return result


def probable_cause(value: float, limits: tuple[float, float], unit: str, other: str) -> str:
    """Return the probable cause of a value outside the limits.

    Another unit, the sign, or else `other`.
    """
    low, high = limits
    limit = high if value > 0 else low
    confused, least = _CONFUSED_UNITS.get(unit, ("", 0.0))
    if confused and limit:
        converted = value * KNOWN_UNITS[confused].factor
        if least <= converted / limit <= _MAX_PART:
            return (
                f"probable cause: {confused} in place of {unit} ({value:.4g} {confused} = "
                f"{converted:.4g} {unit})"
            )
    return "probable cause: the sign" if value < low == 0 else f"probable cause: {other}"


def set_excesses(prepared: PreparedRun) -> dict[tuple[str, str], Problem]:
    """Return a warning for each input without a connection that parameters, settings or events set beyond its limits.

    The keys are component and variable. Only the first value of a variable that is outside is described.
    """
    found: dict[tuple[str, str], Problem] = {}
    places: dict[tuple[str, str], int] = {}
    if not any(component.input_limits for component in prepared.system.components.values()):
        return found
    connected = {
        (end.component, end.scalar)
        for end in (connection.target for connection in prepared.system.connections)
    }
    for name, variable, value, where in _set_values(prepared):
        limits = prepared.system.components[name].input_limits
        scalars = [scalar for scalar in variable.scalar_names if (name, scalar) not in connected]
        given = dict(zip(variable.scalar_names, np.ravel(value).tolist(), strict=False))
        excesses = [
            each
            for each in scalars
            if each in limits and each in given and outside(np.array(given[each]), limits[each])
        ]
        if excesses:
            key = (name, variable.name)
            places[key] = places.get(key, 0) + 1
            found.setdefault(
                key, Problem(_describe(name, variable, excesses, given, limits), where)
            )
    return {key: _with_count(problem, places[key] - 1) for key, problem in found.items()}


def _with_count(problem: Problem, further: int) -> Problem:
    rest = f" (and {count_noun(further, 'further value')})" if further else ""
    return Problem(problem.message + rest, problem.where)


def _set_values(prepared: PreparedRun) -> Iterator[tuple[str, Variable, Any, str]]:
    """Yield component, variable, value and place of everything that parameters, settings and events set."""
    places = _assigned_places(prepared)
    changes = [
        (prepared.system.start_values, ""),
        *((event.values, event.where) for event in prepared.settings.events),
    ]
    for values_by_component, where in changes:
        for name, values in values_by_component.items():
            for variable in prepared.system.components[name].variables:
                if variable.causality == "input" and variable.name in values:
                    yield (
                        name,
                        variable,
                        values[variable.name],
                        where or places.get((name, variable.name), ""),
                    )


def _assigned_places(prepared: PreparedRun) -> Mapping[tuple[str, str], str]:
    """Return the place of the last assignment of each start value, by component and variable."""
    places = {}
    for node, name, _, where in iterate_assignments(prepared.root, prepared.assignments):
        with suppress(UnknownNameError):
            for target in resolve_name(node, name, ("parameters", "inputs"), include_inner=True):
                places[target.component, target.prefix.partition("[")[0]] = where
    return places


def _describe(
    name: str,
    variable: Variable,
    scalars: list[str],
    given: Mapping[str, float],
    limits: Mapping[str, tuple[float, float]],
) -> str:
    first, unit = scalars[0], variable.unit.name if variable.unit else ""
    low, high = limits[first]
    others = f" (and {count_noun(len(scalars) - 1, 'more element')})" if len(scalars) > 1 else ""
    cause = probable_cause(
        given[first], limits[first], unit, "the value, or a value of the vehicle is wrong"
    )
    end = Endpoint(name, first)
    return (
        f"{end}{others} is set to {given[first]:.4g} {unit}, outside its limits {low:.4g} ... "
        f"{high:.4g} {unit}; {cause}"
    )
