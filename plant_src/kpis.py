"""KPIs of a mission.

Waypoints, path following, motor commands, failures, and those of `landing_kpis.py`.

Every function takes a result and names of signals or signal prefixes ("plant.uav",
"plant.usv.deck") and returns values by name. All values are in SI units and belong to recorded
rows; horizontal distances lie in the x-y plane of the world. A value that a run does not have is
NaN or False.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import Prefix, Signal, better, no_value, units
from cosim.results.signal_analysis import require, row_slice, values_in_unit

from .landing_kpis import descent, landing, touchdown
from .recorded_motion import distance_from_line, horizontal_distance, used_waypoints

__all__ = [
    "cross_track",
    "descent",
    "failures",
    "final",
    "landing",
    "motors",
    "touchdown",
    "tracking",
    "waypoints",
]


@better(reached="higher", all_reached="higher", time="lower")
@units(time="s")
@no_value("{vehicle} did not reach this waypoint")
def waypoints(
    result: Result,
    vehicle: Prefix,
    waypoint_x: Sequence[float],
    waypoint_y: Sequence[float],
    acceptance_radius: float,
    waypoint_count: float | None = None,
) -> dict[str, Number]:
    """Evaluate which waypoints a vehicle reached in their order.

    A waypoint is reached at the first row inside its circle of acceptance (Fossen (2021), chapter
    12), not before the waypoint ahead of it. The last four arguments have the names of an
    autopilot's parameters.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.usv").
        waypoint_x: East coordinates of the waypoints (m, world).
        waypoint_y: North coordinates of the waypoints (m, world).
        acceptance_radius: Radius of the circles of acceptance (m).
        waypoint_count: Number of waypoints that are used; None: all.

    Returns:
        Values by name:

        - `reached`: number of waypoints reached in order, counted from the first
        - `all_reached`: true if all waypoints were reached in order
        - `time[1]`, `time[2]`, ...: time at which each waypoint was reached (s); NaN if it was not
    """
    require(
        acceptance_radius > 0,
        f"expected a positive acceptance_radius (m); found {acceptance_radius:g}",
    )
    route = used_waypoints(waypoint_x, waypoint_y, waypoint_count)
    times, row = [math.nan] * len(route), 0
    position_x, position_y = result[f"{vehicle}.position.x"], result[f"{vehicle}.position.y"]
    for i, (x, y) in enumerate(route):
        inside = np.hypot(position_x[row:] - x, position_y[row:] - y) <= acceptance_radius
        if not inside.any():
            break
        row += int(inside.argmax())
        times[i] = float(result.time[row])
    reached = sum(map(math.isfinite, times))
    return {
        "reached": reached,
        "all_reached": reached == len(times),
        **{f"time[{i}]": time for i, time in enumerate(times, start=1)},
    }


@better(rms="lower", max="lower", leg="lower")
@units(rms="m", max="m", leg="m")
@no_value("{vehicle} did not begin this leg")
def cross_track(
    result: Result,
    vehicle: Prefix,
    waypoint_x: Sequence[float],
    waypoint_y: Sequence[float],
    acceptance_radius: float,
    waypoint_count: float | None = None,
) -> dict[str, Number]:
    """Evaluate the cross-track error of a vehicle on the straight legs between waypoints.

    The first leg starts at the position in the first row. A leg begins when the previous waypoint
    is reached (see `waypoints`) and ends when the next waypoint is reached, or with the last row.
    The error is the horizontal distance from the infinite line through both ends of the leg (Fossen
    (2021), chapter 12).

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.usv").
        waypoint_x: East coordinates of the waypoints (m, world).
        waypoint_y: North coordinates of the waypoints (m, world).
        acceptance_radius: Radius of the circles of acceptance (m).
        waypoint_count: Number of waypoints that are used; None: all.

    Returns:
        Values by name:

        - `rms`: root mean square over all rows of all legs (m)
        - `max`: largest error (m)
        - `leg[1]`, `leg[2]`, ...: largest error on each leg (m); NaN for a leg that was not begun
    """
    values = waypoints(result, vehicle, waypoint_x, waypoint_y, acceptance_radius, waypoint_count)
    times = [value for key, value in values.items() if key.startswith("time")]
    position = result[f"{vehicle}.position.x"] + 1j * result[f"{vehicle}.position.y"]
    corners = [
        position[0],
        *(east + 1j * north for east, north in zip(waypoint_x, waypoint_y, strict=True)),
    ]
    begin, errors_of_legs = float(result.time[0]), []
    for start, end, reached in zip(corners, corners[1:], times, strict=False):
        rows = (result.time >= begin) & ~(
            result.time > reached
        )  # no time is later than NaN: an unfinished leg has all rows
        errors_of_legs.append(distance_from_line(position[rows], start, end))
        begin = reached  # no time is at or after NaN: the legs that follow have no rows
    errors = np.concatenate(errors_of_legs)
    return {
        "rms": float(np.sqrt(np.mean(errors**2))),
        "max": float(errors.max()),
        **{
            f"leg[{i}]": float(leg.max()) if leg.size else math.nan
            for i, leg in enumerate(errors_of_legs, start=1)
        },
    }


@better(rms="lower", max="lower")
@units(rms="m", max="m")
@no_value("no rows between start and stop")
def tracking(
    result: Result, vehicle: Prefix, target: Prefix, start: float, stop: float = math.inf
) -> dict[str, Number]:
    """Evaluate the horizontal distance between a vehicle and the target that it follows.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.uav").
        target: Signal prefix of the target ("plant.usv" or "plant.usv.deck").
        start: First time that is evaluated (s).
        stop: Last time that is evaluated (s).

    Returns:
        Values by name, NaN without rows:

        - `rms`: root mean square of the horizontal distance over the rows (m)
        - `max`: largest horizontal distance (m)
    """
    distance = horizontal_distance(result, vehicle, target)[row_slice(result, start, stop)]
    if not distance.size:
        return {"rms": math.nan, "max": math.nan}
    return {"rms": float(np.sqrt(np.mean(distance**2))), "max": float(distance.max())}


@better(stopped_at_end="higher")
@units(stop_time="s", final_speed="rad/s", max_speed="rad/s")
@no_value("a rotor turns at the end")
def motors(result: Result, rotor_speed: Prefix, threshold: float = 1.0) -> dict[str, Number]:
    """Evaluate from the commanded rotor speeds if and when the motors were switched off.

    Args:
        result: Recorded mission.
        rotor_speed: Prefix of the commands `rotor_speed[1]`, `rotor_speed[2]`, ...
            ("uav.mixer.rotor_speed"), in any unit of a speed of rotation.
        threshold: Speed below which a rotor counts as stopped (rad/s).

    Returns:
        Values by name:

        - `stopped_at_end`: true if all commands of the last row are below `threshold`
        - `stop_time`: first time from which all commands stay below `threshold` (s); NaN unless
          `stopped_at_end`
        - `final_speed`: largest command of the last row (rad/s)
        - `max_speed`: largest command of the run (rad/s)
    """
    require(threshold > 0, f"expected a positive threshold (rad/s); found {threshold:g}")
    names = result.signals(f"{rotor_speed}[*]") or [f"{rotor_speed}[1]"]
    fastest = np.max([np.abs(values_in_unit(result, name, "rad/s")) for name in names], axis=0)
    running = np.flatnonzero(fastest >= threshold)
    first_stopped = int(running[-1]) + 1 if running.size else 0
    stopped = first_stopped < len(fastest)
    return {
        "stopped_at_end": stopped,
        "stop_time": float(result.time[first_stopped]) if stopped else math.nan,
        "final_speed": float(fastest[-1]),
        "max_speed": float(fastest.max()),
    }


@better(crashed="lower", ditched="lower")
@units(time="s")
@no_value("{vehicle} neither crashed nor ditched")
def failures(result: Result, vehicle: Prefix) -> dict[str, Number]:
    """Evaluate whether a vehicle of a world crashed or ditched.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.uav").

    Returns:
        Values by name:

        - `crashed`: true after a collision above the crash speed, or after a capsize
        - `ditched`: true if the centre of mass of a multirotor was below the water
        - `time`: time of the first of both (s); NaN without a failure
    """
    crashed, ditched = (
        result[f"{vehicle}.{failure}"].astype(bool) for failure in ("crashed", "ditched")
    )
    rows = np.flatnonzero(crashed | ditched)
    time = float(result.time[rows[0]]) if rows.size else math.nan
    return {"crashed": bool(crashed.any()), "ditched": bool(ditched.any()), "time": time}


@units(value="{signal}")
def final(result: Result, signal: Signal) -> dict[str, float]:
    """Return `value`, the last value of a signal in its own unit."""
    return {"value": result[signal][-1].item()}
