"""Figures of merit by which the replica is compared with the published simulator; SI units, values at recorded rows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import Prefix, units

from ..kpis import waypoints
from ..recorded_motion import horizontal_distance


@units(leg="m")
def overshoots(result: Result, vehicle: Prefix, x: Sequence[float], y: Sequence[float], radius: float) -> dict[str, Number]:
    """`leg[i]` (m): largest distance of `vehicle` from the straight line to waypoint i, while it heads there.

    The lines start where the vehicle started and at the waypoints before (`x`, `y`, m); a leg ends when the circle of `radius`
    (m) is entered. NaN for legs that are not finished.
    """
    switches = [result.time[0], *_waypoint_times(result, vehicle, x, y, radius)]
    position = np.column_stack([result[f"{vehicle}.position.{axis}"] for axis in "xy"])
    corners = [position[0], *np.column_stack([x, y])]
    legs = dict.fromkeys((f"leg[{i}]" for i in range(1, len(x) + 1)), math.nan)
    for i, ((begin, end), (a, b)) in enumerate(zip(pairwise(switches), pairwise(corners), strict=False), start=1):
        along = (b - a) / np.hypot(*(b - a))
        offset = position[(result.time >= begin) & (result.time <= end)] - a
        legs[f"leg[{i}]"] = float(np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]).max())
    return legs


@units(straight="m", turn="m", least_turn="m")
def turns(
    result: Result, vehicle: Prefix, target: Prefix, x: Sequence[float], y: Sequence[float], radius: float, settling: float
) -> dict[str, Number]:
    """How well `vehicle` follows `target`, which turns at the waypoints (`x`, `y`, m) when within `radius` (m) of them.

    straight    m  largest horizontal distance, away from turns: but for `settling` (s) after the start and each waypoint
    turn        m  largest peak within `settling` of a waypoint
    least_turn  m  smallest of these peaks
    """
    switches = _waypoint_times(result, target, x, y, radius)
    distance, time = horizontal_distance(result, vehicle, target), result.time
    windows = [(time >= switch) & (time < switch + settling) for switch in (time[0], *switches)]
    peaks = [float(distance[window].max()) for window in windows[1:]]
    straight = distance[~np.any(windows, axis=0)]
    return {
        "straight": float(straight.max()) if straight.size else math.nan,
        "turn": max(peaks, default=math.nan),
        "least_turn": min(peaks, default=math.nan),
    }


def _waypoint_times(result: Result, vehicle: str, x: Sequence[float], y: Sequence[float], radius: float) -> list[float]:
    """When the waypoints that were reached were reached (s)."""
    reached = waypoints(result, vehicle, x, y, radius)
    return [float(reached[f"time[{i}]"]) for i in range(1, int(reached["reached"]) + 1)]


@units(time="s", error="m", speed="m/s", lowest="m")
def touchdown(
    result: Result, vehicle: Prefix, target: Prefix, rest_height: float, start: float, margin: float = 0.005
) -> dict[str, Number]:
    """The first landing after `start` (s): the origin of `vehicle` comes within `margin` (m) of `rest_height` (m, world).

    time    s    of the touchdown
    error   m    horizontal distance to `target` at touchdown
    speed   m/s  vertical speed one row earlier, downwards > 0
    lowest  m    lowest altitude between `start` and half a second before the touchdown (the dip of the approach)
    """
    z = result[f"{vehicle}.position.z"]
    rows = np.flatnonzero((z <= rest_height + margin) & (result.time >= start))
    if not rows.size:
        return dict.fromkeys(("time", "error", "speed", "lowest"), math.nan)
    row = int(rows[0])
    before = z[(result.time >= start) & (result.time < result.time[row] - 0.5)]
    return {
        "time": float(result.time[row]),
        "error": float(horizontal_distance(result, vehicle, target)[row]),
        "speed": float(-result[f"{vehicle}.velocity.z"][row - 1]),
        "lowest": float(before.min()) if before.size else math.nan,
    }
