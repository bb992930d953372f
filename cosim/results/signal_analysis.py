"""Errors, integrals and step responses of recorded signals."""

import math
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..core.units import named_unit
from .result import Result


class StepResponse(NamedTuple):
    """Step response scaled to 0 at the initial value and 1 at the target.

    Both arrays of shape (rows,).
    """

    time: np.ndarray
    fraction: np.ndarray


def step_response(
    result: Result,
    signal: str,
    start: float,
    stop: float,
    initial: float | None,
    target: float | None,
) -> StepResponse:
    """Return the scaled step response.

    Args:
        result: The run.
        signal: Name of the signal.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.
        initial: Value before the step; None: value of the first row.
        target: Value after the step; None: value of the last row.

    Returns:
        A response without rows if initial value and target are equal.
    """
    rows = row_slice(result, start, stop)
    time, values = result.time[rows], result[signal][rows].astype(np.float64)
    if not values.size:
        return StepResponse(time, values)
    begin = float(values[0]) if initial is None else initial
    end = float(values[-1]) if target is None else target
    return (
        StepResponse(time, (values - begin) / (end - begin))
        if end != begin
        else StepResponse(time[:0], values[:0])
    )


def require(holds: bool, message: str) -> None:
    """Raise InputError with a message about the arguments of a KPI unless a condition holds."""
    if not holds:
        raise InputError(message)


def row_slice(result: Result, start: float, stop: float) -> slice:
    """Return the rows with start <= time <= stop (s).

    Raises:
        InputError: `stop` is before `start`.
    """
    require(start <= stop, f"start {start:g} s is after stop {stop:g} s")
    return slice(
        int(np.searchsorted(result.time, start, "left")),
        int(np.searchsorted(result.time, stop, "right")),
    )


def control_error(
    result: Result, signal: str, target: str | float, start: float, stop: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return time (s) and error, both of shape (rows,).

    Args:
        result: The run.
        signal: Name of the signal.
        target: A number, or the name of another signal, which is converted to the unit of `signal`
            and subtracted.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.

    Raises:
        InputError: The units of both signals measure different quantities.
    """
    rows = row_slice(result, start, stop)
    if isinstance(target, str):
        found, expected = (result.units.get(each, "") for each in (target, signal))
        problem = f'"{target}" ({found}) cannot be compared with "{signal}" ({expected})'
        reference: Any = _convert(result[target], found, expected, problem)
    else:
        reference = target
    return result.time[rows], (result[signal].astype(np.float64) - reference)[rows]


def values_in_unit(result: Result, signal: str, unit: str) -> np.ndarray:
    """Return the values of a signal in a unit, for KPIs that expect a unit.

    A signal without unit is not converted.

    Args:
        result: The run.
        signal: Name of the signal.
        unit: The unit, such as "rad/s".

    Raises:
        InputError: The unit of the signal measures another quantity.
    """
    found = result.units.get(signal, "")
    return _convert(
        result[signal],
        found,
        unit,
        f'"{signal}" has the unit {found}, which does not convert to {unit}',
    )


def values_in_si(result: Result, signal: str) -> np.ndarray:
    """Return the values of a signal in the SI unit of its quantity.

    A signal without known unit is not converted.
    """
    unit = named_unit(result.units.get(signal, ""))
    return unit.factor * result[signal].astype(np.float64) + unit.offset


def _convert(values: np.ndarray, found: str, expected: str, problem: str) -> np.ndarray:
    """Return values in another unit.

    Raise InputError with the text `problem` if the quantity is another one.
    """
    if not (found and expected) or found == expected:
        return values
    unit, target = named_unit(found), named_unit(expected)
    require(unit.converts_to(target), problem)
    factor, offset = unit.conversion(target)
    return factor * values + offset


def integrate(time: np.ndarray, values: np.ndarray) -> float:
    """Return the integral over time by the trapezoidal rule, NaN without rows."""
    return float(np.trapezoid(values, time)) if time.size else math.nan


def time_average(time: np.ndarray, values: np.ndarray) -> float:
    """Return the mean over time by the trapezoidal rule, NaN without rows."""
    if not time.size:
        return math.nan
    return (
        integrate(time, values) / float(time[-1] - time[0])
        if time[-1] > time[0]
        else float(values.mean())
    )


def first_crossing_time(time: np.ndarray, values: np.ndarray, level: float) -> float:
    """Return the first time at which the polyline through the rows reaches a level.

    Args:
        time: Times (s), shape (rows,).
        values: Values, shape (rows,).
        level: The level, reached from below.

    Returns:
        Time (s), interpolated linearly; NaN if the level is never reached.
    """
    above = np.flatnonzero(values >= level)
    if not above.size:
        return math.nan
    row = above[0]
    if row == 0:
        return float(time[0])
    fraction = (level - values[row - 1]) / (values[row] - values[row - 1])
    return float(time[row - 1] + fraction * (time[row] - time[row - 1]))
