"""Warnings about inputs that were outside the limits of their component for a long part of a run, mostly by a wrong unit."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ..core.component import Variable
from ..core.recording import Recording
from ..core.system import Connection, Endpoint
from ..core.text import count_noun
from ..engine.transfer_plan import connection_conversion
from ..scenario import PreparedRun
from ..scenario.input_limits import outside, probable_cause, set_excesses

#: share of the rows from which on an input outside its limits causes a warning
MIN_SHARE = 0.25


class _Excess(NamedTuple):
    """Element of an input that was outside its limits.

    Attributes:
        end: The element.
        variable: The input.
        share: Share of the rows.
        extreme: Value outside the limits with the largest magnitude.
        limits: Lower and upper limit.
    """

    end: Endpoint
    variable: Variable
    share: float
    extreme: float
    limits: tuple[float, float]


def warn_exceeded_limits(prepared: PreparedRun, recording: Recording) -> None:
    """Log a warning for every input that was set beyond its limits, or was outside them in at least a quarter of the rows.

    The limits are those of `Component.input_limits`. Without having been set, an input is known if it is recorded, or all outputs
    that feed it are.
    """
    if not len(recording.time):
        return
    known = set_excesses(prepared)
    excesses = groupby(
        _find_excesses(prepared, recording, known),
        lambda excess: (excess.end.component, excess.variable.name),
    )
    for text in (
        *map(str, known.values()),
        *(_describe(list(elements)) for _, elements in excesses),
    ):
        logging.getLogger("cosim").warning("%s", text)


def _find_excesses(
    prepared: PreparedRun, recording: Recording, known: Collection[tuple[str, str]]
) -> Iterator[_Excess]:
    """Yield the elements outside their limits, without unconnected inputs that are `known` by component and variable."""
    system = prepared.system
    limits = {
        Endpoint(name, scalar): each
        for name, component in system.components.items()
        for scalar, each in component.input_limits.items()
    }
    if not limits:
        return
    recorded = {
        end: recording.columns[name]
        for name, end in prepared.settings.columns.items()
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


def _describe(elements: list[_Excess]) -> str:
    """Return the warning about one input, with the numbers of the element that is outside its limits for the longest time."""
    worst = max(elements, key=lambda excess: excess.share)
    unit = worst.variable.unit.name if worst.variable.unit else ""
    low, high = worst.limits
    others = f" (and {count_noun(len(elements) - 1, 'more element')})" if len(elements) > 1 else ""
    cause = probable_cause(
        worst.extreme,
        worst.limits,
        unit,
        "the controller saturates, or a value of the vehicle is wrong",
    )
    return (
        f"{worst.end}{others} is outside its limits {low:.4g} ... {high:.4g} {unit} in "
        f"{100 * worst.share:.0f} % of the run, "
        f"up to {worst.extreme:.4g} {unit}; {cause}"
    )
