"""KPIs of any signal, for every scenario.

    {"name": "altitude_error", "python": "cosim.kpis:rms", "arguments": {"signal":
    "plant.uav.position.z", "target": 2.0}}

Each function returns one number with the name `value`, NaN if it is undefined. Its unit is that of
the signal unless stated otherwise. Signals are interpolated linearly between rows; integrals use
the trapezoidal rule.

Arguments that several functions have:
    result: The recorded run.
    signal: Name of a recorded signal.
    target: A number, or the name of another signal. The error is signal - target; without a target
        it is the signal itself.
    start: Time (s) of the first row that counts, by default the first row.
    stop: Time (s) of the last row that counts, by default the last row.
"""

import math

import numpy as np

from .results import Result
from .results.kpi import Signal, better, no_value, units
from .results.signal_analysis import (
    control_error,
    first_crossing_time,
    integrate,
    require,
    row_slice,
    step_response,
    time_average,
    values_in_si,
)

FOREVER = math.inf


@better(value="lower")
@units(value="{signal}")
@no_value("no rows from start to stop, or {signal} is NaN")
def rms(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the root mean square of the error over time."""
    time, error = control_error(result, signal, target, start, stop)
    return {"value": math.sqrt(time_average(time, error**2))}


@units(value="{signal}")
@no_value("no rows from start to stop, or {signal} is NaN")
def mean(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the mean of the error over time."""
    return {"value": time_average(*control_error(result, signal, target, start, stop))}


@units(value="{signal}")
@no_value("no rows from start to stop, or {signal} is NaN")
def maximum(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the maximum of the error, a signed number."""
    _, error = control_error(result, signal, target, start, stop)
    return {"value": float(error.max()) if error.size else math.nan}


@units(value="{signal}")
@no_value("no rows from start to stop, or {signal} is NaN")
def minimum(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the minimum of the error, a signed number."""
    _, error = control_error(result, signal, target, start, stop)
    return {"value": float(error.min()) if error.size else math.nan}


@better(value="lower")
@units(value="{signal}")
@no_value("no rows from start to stop, or {signal} is NaN")
def peak(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the maximum of the absolute error."""
    _, error = control_error(result, signal, target, start, stop)
    return {"value": float(np.abs(error).max()) if error.size else math.nan}


@units(value="{signal}")
@no_value("no rows from start to stop, or {signal} is NaN")
def final(
    result: Result, signal: Signal, target: Signal | float = 0.0, stop: float = FOREVER
) -> dict[str, float]:
    """Return the error in the last row."""
    _, error = control_error(result, signal, target, -FOREVER, stop)
    return {"value": float(error[-1]) if error.size else math.nan}


@better(value="lower")
@units(value="{signal}.s")
@no_value("no rows from start to stop, or {signal} is NaN")
def iae(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the integral of the absolute error (IAE), in the unit of the signal times s."""
    time, error = control_error(result, signal, target, start, stop)
    return {"value": integrate(time, np.abs(error))}


@better(value="lower")
@units(value="{signal}2.s")
@no_value("no rows from start to stop, or {signal} is NaN")
def ise(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the integral of the squared error (ISE), in the squared unit of the signal times s."""
    time, error = control_error(result, signal, target, start, stop)
    return {"value": integrate(time, error**2)}


@better(value="lower")
@units(value="{signal}.s2")
@no_value("no rows from start to stop, or {signal} is NaN")
def itae(
    result: Result,
    signal: Signal,
    target: Signal | float = 0.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the integral of the absolute error times the time since the first row (ITAE).

    Its unit is that of the signal times s2.
    """
    time, error = control_error(result, signal, target, start, stop)
    return {"value": integrate(time, (time - time[:1]) * np.abs(error))}


@better(value="lower")
@units(value="J")
@no_value("no rows from start to stop, or {effort} is NaN")
def energy(
    result: Result,
    effort: Signal,
    flow: Signal | float = 1.0,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the integral of effort times flow over time (J).

    Args:
        result: The recorded run.
        effort: Name of a force, a torque or a power; its values are converted to N, N.m or W.
        flow: Name of a speed for a force, of an angular rate for a torque, converted to m/s or
            rad/s; 1 for a power.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.
    """
    rows = row_slice(result, start, stop)
    power = values_in_si(result, effort) * (
        values_in_si(result, flow) if isinstance(flow, str) else flow
    )
    return {"value": integrate(result.time[rows], power[rows])}


@better(value="lower")
@no_value("no rows from start to stop, or {signal} is NaN")
def saturation_share(
    result: Result,
    signal: Signal,
    lower: float = -FOREVER,
    upper: float = FOREVER,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Return the share of the time (1) during which a signal is saturated.

    Each value holds until the next row.

    Args:
        result: The recorded run.
        signal: Name of a recorded signal.
        lower: Lower limit; values at or below it are saturated.
        upper: Upper limit; values at or above it are saturated.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.
    """
    require(lower <= upper, f"lower limit {lower:g} is above upper limit {upper:g}")
    rows = row_slice(result, start, stop)
    time, values = result.time[rows], result[signal][rows]
    if len(time) < 2 or time[-1] == time[0] or np.isnan(values).any():
        return {"value": math.nan}
    saturated = (values <= lower) | (values >= upper)
    return {"value": float(np.diff(time) @ saturated[:-1] / (time[-1] - time[0]))}


@better(value="lower")
@units(value="s")
@no_value("{signal} does not reach {level}")
def time_to_reach(
    result: Result, signal: Signal, level: float, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Return the time (s) until a signal first reaches a level, from above or below.

    It counts from the first row.

    Args:
        result: The recorded run.
        signal: Name of a recorded signal.
        level: The level, in the unit of the signal.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.
    """
    rows = row_slice(result, start, stop)
    time, values = result.time[rows], result[signal][rows].astype(np.float64)
    side = -1.0 if values.size and values[0] > level else 1.0
    return {
        "value": first_crossing_time(time, side * values, side * level)
        - (time[0] if time.size else 0.0)
    }


@better(value="lower")
@units(value="s")
@no_value("{signal} makes no step, or does not reach the fraction")
def rise_time(
    result: Result,
    signal: Signal,
    start: float = -FOREVER,
    stop: float = FOREVER,
    initial: float | None = None,
    target: float | None = None,
    low: float = 0.1,
    high: float = 0.9,
) -> dict[str, float]:
    """Return the rise time of a step response (s).

    From first reaching the fraction `low` of the step to first reaching `high`.

    Args:
        result: The recorded run.
        signal: Name of a recorded signal.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.
        initial: Value before the step; None: value of the first row.
        target: Value after the step; None: value of the last row.
        low: Fraction of the step from `initial` to `target` (1).
        high: Fraction of the step from `initial` to `target` (1).
    """
    require(0 <= low < high, f"expected 0 <= low < high; found low {low:g}, high {high:g}")
    step = step_response(result, signal, start, stop, initial, target)
    return {
        "value": first_crossing_time(step.time, step.fraction, high)
        - first_crossing_time(step.time, step.fraction, low)
    }


@better(value="lower")
@no_value("{signal} makes no step")
def overshoot(
    result: Result,
    signal: Signal,
    start: float = -FOREVER,
    stop: float = FOREVER,
    initial: float | None = None,
    target: float | None = None,
) -> dict[str, float]:
    """Return the largest overshoot as a fraction of the step (1), 0 if there is none.

    Arguments as for `rise_time`.
    """
    fraction = step_response(result, signal, start, stop, initial, target).fraction
    return {"value": max(float(fraction.max()) - 1, 0.0) if fraction.size else math.nan}


@better(value="lower")
@units(value="s")
@no_value("{signal} is outside the band at the end")
def settling_time(
    result: Result,
    signal: Signal,
    start: float = -FOREVER,
    stop: float = FOREVER,
    initial: float | None = None,
    target: float | None = None,
    band: float = 0.02,
) -> dict[str, float]:
    """Return the settling time (s) after the first row.

    NaN if the last row is outside the band or any row is NaN.

    Args:
        result: The recorded run.
        signal: Name of a recorded signal.
        start: Time (s) of the first row that counts.
        stop: Time (s) of the last row that counts.
        initial: Value before the step; None: value of the first row.
        target: Value after the step; None: value of the last row.
        band: Half width of the band around the target as a fraction of the step from `initial` to
            `target` (1).
    """
    require(band >= 0, f"expected a band of 0 or more; found {band:g}")
    time, fraction = step_response(result, signal, start, stop, initial, target)
    distance = np.abs(fraction - 1)
    outside = np.flatnonzero(~(distance <= band))
    if not fraction.size or np.isnan(distance).any() or distance[-1] > band:
        return {"value": math.nan}
    if not outside.size:
        return {"value": 0.0}
    last = outside[-1]
    return {"value": first_crossing_time(time[last:], -distance[last:], -band) - float(time[0])}
