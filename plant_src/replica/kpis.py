"""KPIs that compare the replica with the published simulator, in SI units."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import Prefix, units

from ..kpis import waypoints
from ..recorded_motion import horizontal_distance, used_waypoints


@units(leg="m")
def overshoots(
    result: Result,
    vehicle: Prefix,
    waypoint_x: Sequence[float],
    waypoint_y: Sequence[float],
    acceptance_radius: float,
    waypoint_count: float | None = None,
) -> dict[str, Number]:
    """Evaluate the largest distance from each leg between waypoints.

    The first leg starts at the position in the first row. A leg ends when its circle of acceptance
    is entered.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.usv").
        waypoint_x: East coordinates of the waypoints (m, world).
        waypoint_y: North coordinates of the waypoints (m, world).
        acceptance_radius: Radius of the circles of acceptance (m).
        waypoint_count: Number of waypoints that are used; None: all.

    Returns:
        `leg[1]`, `leg[2]`, ...: largest distance from the straight line to each waypoint (m); NaN
        for unfinished legs.
    """
    switches = [
        result.time[0],
        *_reached_times(
            waypoints(result, vehicle, waypoint_x, waypoint_y, acceptance_radius, waypoint_count)
        ),
    ]
    position = np.column_stack([result[f"{vehicle}.position.{axis}"] for axis in "xy"])
    corners = [position[0], *np.array(used_waypoints(waypoint_x, waypoint_y, waypoint_count))]
    legs = dict.fromkeys((f"leg[{i}]" for i in range(1, len(corners))), math.nan)
    for i, ((begin, end), (a, b)) in enumerate(
        zip(pairwise(switches), pairwise(corners), strict=False), start=1
    ):
        direction = (b - a) / np.hypot(*(b - a))
        offset = position[(result.time >= begin) & (result.time <= end)] - a
        legs[f"leg[{i}]"] = float(
            np.abs(offset[:, 0] * direction[1] - offset[:, 1] * direction[0]).max()
        )
    return legs


@units(straight="m", turn="m", least_turn="m")
def turns(
    result: Result,
    vehicle: Prefix,
    target: Prefix,
    waypoint_x: Sequence[float],
    waypoint_y: Sequence[float],
    acceptance_radius: float,
    settling: float,
    waypoint_count: float | None = None,
) -> dict[str, Number]:
    """Evaluate how a vehicle follows a target on straight legs and in turns at waypoints.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.uav").
        target: Signal prefix of the target ("plant.usv").
        waypoint_x: East coordinates of the target's waypoints (m, world).
        waypoint_y: North coordinates of the target's waypoints (m, world).
        acceptance_radius: Radius of the circles of acceptance (m).
        settling: Time after the start and after each waypoint that does not count as straight (s).
        waypoint_count: Number of waypoints that are used; None: all.

    Returns:
        Values by name:

        - `straight`: largest horizontal distance outside the settling times (m)
        - `turn`: largest of the peaks within `settling` after each waypoint (m)
        - `least_turn`: smallest of these peaks (m)
    """
    switches = _reached_times(
        waypoints(result, target, waypoint_x, waypoint_y, acceptance_radius, waypoint_count)
    )
    distance, time = horizontal_distance(result, vehicle, target), result.time
    windows = [(time >= switch) & (time < switch + settling) for switch in (time[0], *switches)]
    peaks = [float(distance[window].max()) for window in windows[1:]]
    straight = distance[~np.any(windows, axis=0)]
    return {
        "straight": float(straight.max()) if straight.size else math.nan,
        "turn": max(peaks, default=math.nan),
        "least_turn": min(peaks, default=math.nan),
    }


def _reached_times(values: Mapping[str, Number]) -> list[float]:
    """Return the times (s) of the waypoints that were reached, from the values of `waypoints`."""
    return [float(values[f"time[{i}]"]) for i in range(1, int(values["reached"]) + 1)]


@units(time="s", error="m", speed="m/s", lowest="m")
def touchdown(
    result: Result,
    vehicle: Prefix,
    target: Prefix,
    rest_height: float,
    start: float,
    margin: float = 0.005,
) -> dict[str, Number]:
    """Evaluate the first touchdown after `start`, found by the altitude.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the quadcopter ("plant.uav").
        target: Signal prefix of the vessel ("plant.usv").
        rest_height: Altitude of the quadcopter's origin at rest on the deck (m, world).
        start: First time that is evaluated (s).
        margin: Altitude above `rest_height` that counts as touchdown (m).

    Returns:
        Values by name, all NaN without a touchdown:

        - `time`: time of the touchdown (s)
        - `error`: horizontal distance to the target at touchdown (m)
        - `speed`: downward speed one row earlier (m/s)
        - `lowest`: lowest altitude between `start` and 0.5 s before touchdown, the undershoot of
          the approach (m)
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
