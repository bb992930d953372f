"""Warnings about inputs that were outside the limits of their component for a long part of a run, mostly by a wrong unit."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator, Mapping
from itertools import groupby
from typing import NamedTuple

import numpy as np

from ..core.component import Variable
from ..core.recording import Recording
from ..core.system import Connection, Endpoint
from ..core.text import count_noun
from ..core.units import KNOWN_UNITS
from ..engine.transfer_plan import connection_conversion
from ..scenario import PreparedRun

#: share of the rows from which on an input outside its limits causes a warning
MIN_SHARE = 0.25
#: part of a limit by which a value may exceed it
_MARGIN = 0.01
#: unit of an input -> units in which its value is often given by mistake
_CONFUSED_UNITS = {"rad/s": "rpm", "rad": "deg"}


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
    """Log a warning for every input that was outside its limits in at least a quarter of the rows.

    The limits are those of `Component.input_limits`. An input is known if it is recorded, or all outputs that feed it are.
    """
    if not len(recording.time):
        return
    excesses = _find_excesses(prepared, recording)
    for _, elements in groupby(excesses, lambda excess: (excess.end.component, excess.variable.name)):
        logging.getLogger("cosim").warning("%s", _describe(list(elements)))


def _find_excesses(prepared: PreparedRun, recording: Recording) -> Iterator[_Excess]:
    system = prepared.system
    limits = {
        Endpoint(name, scalar): each
        for name, component in system.components.items()
        for scalar, each in component.input_limits.items()
    }
    if not limits:
        return
    recorded = {end: recording.columns[name] for name, end in prepared.settings.columns.items() if name in recording.columns}
    feeding: dict[Endpoint, list[Connection]] = {}
    for connection in system.connections:
        feeding.setdefault(connection.target, []).append(connection)
    for end, (low, high) in limits.items():
        values = recorded[end] if end in recorded else _fed_values(prepared, feeding.get(end, ()), recorded)
        if values is not None:
            outside = (values < low - _MARGIN * abs(low)) | (values > high + _MARGIN * abs(high))
            if (share := float(np.mean(outside))) >= MIN_SHARE:
                extreme = values[outside][np.argmax(np.abs(values[outside]))]
                yield _Excess(end, system.find_element(end).variable, share, float(extreme), (low, high))


def _fed_values(
    prepared: PreparedRun, connections: Iterable[Connection], recorded: Mapping[Endpoint, np.ndarray]
) -> np.ndarray | None:
    """Return the sum of the values that connections transfer, without their delay; None without any or if one is not recorded."""
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
    return (
        f"{worst.end}{others} is outside its limits {low:.4g} ... {high:.4g} {unit} in {100 * worst.share:.0f} % of the run, "
        f"up to {worst.extreme:.4g} {unit}; {_probable_cause(worst, unit)}"
    )


def _probable_cause(excess: _Excess, unit: str) -> str:
    low, high = excess.limits
    if confused := _CONFUSED_UNITS.get(unit):
        value = excess.extreme * KNOWN_UNITS[confused].factor
        if low <= value <= high:
            return f"probable cause: {confused} in place of {unit} ({excess.extreme:.4g} {confused} = {value:.4g} {unit})"
    if excess.extreme < low == 0:
        return "probable cause: the sign"
    return f"probable causes: another unit than {unit}, or gains of the controller that are too large"
