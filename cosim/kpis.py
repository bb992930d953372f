"""KPIs of any signal, for every scenario:

    {"name": "altitude_error", "python": "cosim.kpis:rms", "arguments": {"signal": "plant.uav.position.z", "target": 2.0}}

Each function looks at the rows with start <= time <= stop (s) and returns its number as `value`, NaN where there is none. Between
rows signals are straight lines; integrals go by the trapezoidal rule. `target` is a number or the name of another signal; errors
are signal - target. A number whose unit is not mentioned has that of the signal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .results import Result
from .results.kpi import Signal, better, first_crossing_time, units

FOREVER = math.inf


@better(value="lower")
@units(value="{signal}")
def rms(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Root of the mean squared error over time."""
    time, error = _control_error(result, signal, target, start, stop)
    return {"value": math.sqrt(_time_average(time, error**2))}


@units(value="{signal}")
def mean(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Mean error over time."""
    return {"value": _time_average(*_control_error(result, signal, target, start, stop))}


@units(value="{signal}")
def maximum(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Largest error, with its sign: the largest value of the signal where there is no target."""
    _, error = _control_error(result, signal, target, start, stop)
    return {"value": float(error.max()) if error.size else math.nan}


@units(value="{signal}")
def minimum(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Smallest error, with its sign."""
    _, error = _control_error(result, signal, target, start, stop)
    return {"value": float(error.min()) if error.size else math.nan}


@better(value="lower")
@units(value="{signal}")
def peak(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Largest error without its sign."""
    _, error = _control_error(result, signal, target, start, stop)
    return {"value": float(np.abs(error).max()) if error.size else math.nan}


@units(value="{signal}")
def final(result: Result, signal: Signal, target: Signal | float = 0.0, stop: float = FOREVER) -> dict[str, float]:
    """Error in the last row."""
    _, error = _control_error(result, signal, target, -FOREVER, stop)
    return {"value": float(error[-1]) if error.size else math.nan}


@better(value="lower")
@units(value="{signal}.s")
def iae(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Integral of the absolute error, in the signal's unit times s."""
    time, error = _control_error(result, signal, target, start, stop)
    return {"value": _integrate(time, np.abs(error))}


@better(value="lower")
@units(value="{signal}2.s")
def ise(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Integral of the squared error, in the signal's unit squared times s."""
    time, error = _control_error(result, signal, target, start, stop)
    return {"value": _integrate(time, error**2)}


@better(value="lower")
@units(value="{signal}.s2")
def itae(
    result: Result, signal: Signal, target: Signal | float = 0.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Integral of the absolute error times the time since the first row, in the signal's unit times s2."""
    time, error = _control_error(result, signal, target, start, stop)
    return {"value": _integrate(time, (time - time[:1]) * np.abs(error))}


@better(value="lower")
@units(value="J")
def energy(
    result: Result, effort: Signal, flow: Signal | float = 1.0, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Integral of effort times flow (J): of force (N) and speed (m/s), torque (N.m) and rate (rad/s), or of a power (W) alone."""
    rows = _row_slice(result, start, stop)
    power = result[effort].astype(np.float64) * (result[flow] if isinstance(flow, str) else flow)
    return {"value": _integrate(result.time[rows], power[rows])}


@better(value="lower")
def saturation_share(
    result: Result,
    signal: Signal,
    lower: float = -FOREVER,
    upper: float = FOREVER,
    start: float = -FOREVER,
    stop: float = FOREVER,
) -> dict[str, float]:
    """Share of the time (1) with the signal at `lower` or below or at `upper` or above; each row's value holds until the next."""
    rows = _row_slice(result, start, stop)
    time, values = result.time[rows], result[signal][rows]
    if len(time) < 2 or time[-1] == time[0]:
        return {"value": math.nan}
    if np.isnan(values).any():
        return {"value": math.nan}
    saturated = (values <= lower) | (values >= upper)
    return {"value": float(np.diff(time) @ saturated[:-1] / (time[-1] - time[0]))}


@better(value="lower")
@units(value="s")
def time_to_reach(
    result: Result, signal: Signal, level: float, start: float = -FOREVER, stop: float = FOREVER
) -> dict[str, float]:
    """Time (s) from the first row until the signal first is at `level` or has crossed it, whichever side it came from."""
    rows = _row_slice(result, start, stop)
    time, values = result.time[rows], result[signal][rows].astype(np.float64)
    side = -1.0 if values.size and values[0] > level else 1.0
    return {"value": first_crossing_time(time, side * values, side * level) - (time[0] if time.size else 0.0)}


@better(value="lower")
@units(value="s")
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
    """Time (s) that a step response takes from the share `low` (1) of its way to the share `high`, each reached the first time.

    The way goes from `initial`, without one the value of the first row, to `target`, without one the value of the last row.
    """
    step = _step_response(result, signal, start, stop, initial, target)
    return {"value": first_crossing_time(step.time, step.fraction, high) - first_crossing_time(step.time, step.fraction, low)}


@better(value="lower")
def overshoot(
    result: Result,
    signal: Signal,
    start: float = -FOREVER,
    stop: float = FOREVER,
    initial: float | None = None,
    target: float | None = None,
) -> dict[str, float]:
    """How far a step response goes beyond its target at most, as a share of its way (1; see `rise_time`); 0 when it does not."""
    share = _step_response(result, signal, start, stop, initial, target).fraction
    return {"value": max(float(share.max()) - 1, 0.0) if share.size else math.nan}


@better(value="lower")
@units(value="s")
def settling_time(
    result: Result,
    signal: Signal,
    start: float = -FOREVER,
    stop: float = FOREVER,
    initial: float | None = None,
    target: float | None = None,
    band: float = 0.02,
) -> dict[str, float]:
    """Time (s) from the first row until a step response stays within `band` times its way (see `rise_time`) of its target.

    NaN when the last row is outside, or when a row is not a number.
    """
    time, share = _step_response(result, signal, start, stop, initial, target)
    away = np.abs(share - 1)
    outside = np.flatnonzero(~(away <= band))
    if not share.size or np.isnan(away).any() or away[-1] > band:
        return {"value": math.nan}
    if not outside.size:
        return {"value": 0.0}
    last = outside[-1]
    return {"value": first_crossing_time(time[last:], -away[last:], -band) - float(time[0])}


class _StepResponse(NamedTuple):
    """A response as the share of its way from initial value (0) to target (1)."""

    time: np.ndarray
    fraction: np.ndarray


def _step_response(
    result: Result, signal: str, start: float, stop: float, initial: float | None, target: float | None
) -> _StepResponse:
    """Without any rows when there are none or no way to go."""
    rows = _row_slice(result, start, stop)
    time, values = result.time[rows], result[signal][rows].astype(np.float64)
    if not values.size:
        return _StepResponse(time, values)
    begin = float(values[0]) if initial is None else initial
    end = float(values[-1]) if target is None else target
    return _StepResponse(time, (values - begin) / (end - begin)) if end != begin else _StepResponse(time[:0], values[:0])


def _row_slice(result: Result, start: float, stop: float) -> slice:
    return slice(int(np.searchsorted(result.time, start, "left")), int(np.searchsorted(result.time, stop, "right")))


def _control_error(
    result: Result, signal: str, target: Signal | float, start: float, stop: float
) -> tuple[np.ndarray, np.ndarray]:
    rows = _row_slice(result, start, stop)
    wanted = result[target] if isinstance(target, str) else target
    return result.time[rows], (result[signal].astype(np.float64) - wanted)[rows]


def _integrate(time: np.ndarray, values: np.ndarray) -> float:
    return float(np.trapezoid(values, time)) if time.size else math.nan


def _time_average(time: np.ndarray, values: np.ndarray) -> float:
    if not time.size:
        return math.nan
    return _integrate(time, values) / float(time[-1] - time[0]) if time[-1] > time[0] else float(values.mean())
