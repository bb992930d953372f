"""Warnings about inputs outside the limits of their component.

Values that a scenario or its caller sets are compared with the limits before the run, recorded
values after it. A warning names the probable cause, mostly a wrong unit.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.component import Variable
from ..core.errors import Problem
from ..core.recording import Recording
from ..core.system import Connection, Endpoint
from ..core.text import count_noun
from ..core.units import KNOWN_UNITS
from ..engine.transfer_plan import connection_conversion
from .name_resolution import UnknownNameError, iterate_assignments, resolve_name

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
    """Return a mask of the values that are outside the limits by more than 1 %."""
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
    """Return a warning for each unconnected input that is set beyond its limits.

    Parameters, settings and events set inputs.

    The keys are component and variable. Only the first value of a variable that is outside is
    described.
    """
    found: dict[tuple[str, str], Problem] = {}
    places: dict[tuple[str, str], int] = {}
    if not any(component.input_limits for component in prepared.system.components.values()):
        return found
    connected = {connection.target for connection in prepared.system.connections}
    for name, variable, value, where in _set_values(prepared):
        limits = prepared.system.components[name].input_limits
        scalars = [each for each in variable.scalar_names if (name, each) not in connected]
        given = dict(zip(variable.scalar_names, np.ravel(value).tolist(), strict=False))
        excesses = [
            each
            for each in scalars
            if each in limits and each in given and outside(np.array(given[each]), limits[each])
        ]
        if excesses:
            key = (name, variable.name)
            places[key] = places.get(key, 0) + 1
            first = excesses[0]
            excess = _Excess(Endpoint(name, first), variable, 0.0, given[first], limits[first])
            found.setdefault(key, Problem(_describe(excess, len(excesses)), where))
    for key, problem in found.items():
        if further := places[key] - 1:
            text = f"{problem.message} (and {count_noun(further, 'further value')})"
            found[key] = Problem(text, problem.where)
    return found


def _set_values(prepared: PreparedRun) -> Iterator[tuple[str, Variable, Any, str]]:
    """Yield component, variable, value and place of all values that are set.

    Parameters, settings and events set them.
    """
    # place of the last assignment of each start value, by component and variable
    places: dict[tuple[str, str], str] = {}
    for node, name, _, where in iterate_assignments(prepared.root, prepared.assignments):
        with suppress(UnknownNameError):
            for target in resolve_name(node, name, ("parameters", "inputs"), include_inner=True):
                places[target.component, target.prefix.partition("[")[0]] = where
    changes = [
        (prepared.system.start_values, ""),
        *((event.values, event.where) for event in prepared.plan.settings.events),
    ]
    for values_by_component, where in changes:
        for name, values in values_by_component.items():
            for variable in prepared.system.components[name].variables:
                if variable.causality == "input" and variable.name in values:
                    place = where or places.get((name, variable.name), "")
                    yield name, variable, values[variable.name], place


def _describe(excess: _Excess, count: int) -> str:
    """Return the warning about one input, of which a number of elements is outside."""
    end, variable, share, value, limits = excess
    unit = variable.unit.name if variable.unit else ""
    others = f" (and {count_noun(count - 1, 'more element')})" if count > 1 else ""
    span = f"outside its limits {limits[0]:.4g} ... {limits[1]:.4g} {unit}"
    if not share:
        cause = probable_cause(value, limits, unit, "the value, or a value of the vehicle is wrong")
        return f"{end}{others} is set to {value:.4g} {unit}, {span}; {cause}"
    other = "the controller saturates, or a value of the vehicle is wrong"
    cause = probable_cause(value, limits, unit, other)
    part = f"in {100 * share:.0f} % of the run, up to {value:.4g} {unit}"
    return f"{end}{others} is {span} {part}; {cause}"


#: share of the rows from which on an input outside its limits causes a warning
MIN_SHARE = 0.25


class _Excess(NamedTuple):
    """Element of an input that was outside its limits.

    Attributes:
        end: The element.
        variable: The input.
        share: Share of the rows; 0 for a value that is set.
        extreme: Value outside the limits with the largest magnitude.
        limits: Lower and upper limit.
    """

    end: Endpoint
    variable: Variable
    share: float
    extreme: float
    limits: tuple[float, float]


def warn_exceeded_limits(prepared: PreparedRun, recording: Recording) -> None:
    """Log a warning for every input that was outside its limits.

    It was set beyond them, or outside them in at least a quarter of the rows.

    The limits are those of `Component.input_limits`. Without having been set, an input is known
    if it is recorded, or all outputs
    that feed it are.
    """
    if not len(recording.time):
        return
    known = set_excesses(prepared)
    excesses = groupby(
        _find_excesses(prepared, recording, known),
        lambda excess: (excess.end.component, excess.variable.name),
    )
    texts = list(map(str, known.values()))
    for _, group in excesses:
        elements = list(group)
        # the element that is outside for the longest time
        texts.append(_describe(max(elements, key=lambda excess: excess.share), len(elements)))
    for text in texts:
        logging.getLogger("cosim").warning("%s", text)


def _find_excesses(
    prepared: PreparedRun, recording: Recording, known: Collection[tuple[str, str]]
) -> Iterator[_Excess]:
    """Yield the elements outside their limits.

    Unconnected inputs that are `known` by component and variable are left out.
    """
    system = prepared.system
    limits: dict[Endpoint, tuple[float, float]] = {}
    for name, component in system.components.items():
        for scalar, each in component.input_limits.items():
            limits[Endpoint(name, scalar)] = each
    if not limits:
        return
    recorded = {
        end: recording.columns[name]
        for name, end in prepared.plan.settings.columns.items()
        if name in recording.columns
    }
    feeding: dict[Endpoint, list[Connection]] = {}
    for connection in system.connections:
        feeding.setdefault(connection.target, []).append(connection)
    for end, each in limits.items():
        values = (
            recorded[end]
            if end in recorded
            else _fed_values(prepared, feeding.get(end, ()), recorded)
        )
        variable = system.find_element(end).variable
        if values is not None and not (
            (end.component, variable.name) in known and end not in feeding
        ):
            exceeding = outside(values, each)
            if (share := float(np.mean(exceeding))) >= MIN_SHARE:
                extreme = values[exceeding][np.argmax(np.abs(values[exceeding]))]
                yield _Excess(end, variable, share, float(extreme), each)


def _fed_values(
    prepared: PreparedRun,
    connections: Iterable[Connection],
    recorded: Mapping[Endpoint, np.ndarray],
) -> np.ndarray | None:
    """Return the sum of the values that connections transfer, without their delay.

    None without any or if one is not recorded.
    """
    total: np.ndarray | None = None
    for connection in connections:
        if connection.source not in recorded:
            return None
        factor, offset = connection_conversion(prepared.system, connection)
        values = factor * recorded[connection.source] + offset
        total = values if total is None else total + values
    return total
