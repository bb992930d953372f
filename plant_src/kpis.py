"""KPIs of a mission.

Waypoints, path following, motor commands, failures, landings and touchdowns.

Every function takes a result and names of signals or signal prefixes ("plant.uav",
"plant.usv.deck") and returns values by name. All values are in SI units and belong to recorded
rows; horizontal distances lie in the x-y plane of the world. A value that a run does not have is
NaN or False.
"""

import math
from collections.abc import Sequence

import numpy as np

from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import NoValue, Prefix, Signal, better, declared_units, no_value, units
from cosim.results.signal_analysis import require, row_slice, values_in_unit

from .recorded_motion import (
    MIN_FLIGHT_TIME,
    distance_from_line,
    horizontal_distance,
    relative_position,
    relative_tilt,
    relative_velocity,
    slide_distance,
    touchdown_row,
    used_waypoints,
)


@better(
    lateral_error="lower",
    touchdown_speed="lower",
    tangential_speed="lower",
    slide="lower",
    bounces="lower",
    landed_at_end="higher",
    final_lateral_error="lower",
)
@units(
    time="s",
    lateral_error="m",
    touchdown_speed="m/s",
    tangential_speed="m/s",
    slide="m",
    final_lateral_error="m",
)
def landing(result: Result, vehicle: Prefix, deck: Prefix) -> dict[str, Number]:
    """Evaluate the landing of a multirotor on a vessel in the world frame.

    Touchdown is the first row with contact between the vehicle and a vessel after a flight of at
    least 0.1 s. The lateral error at touchdown is the landing error of the paper (docs/paper.md).

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the multirotor ("plant.uav").
        deck: Signal prefix of the landing deck ("plant.usv.deck").

    Returns:
        Values by name:

        - `time`: time of the touchdown (s)
        - `lateral_error`: horizontal distance of the vehicle's centre of mass from the deck centre
          at touchdown (m)
        - `touchdown_speed`: vertical speed relative to the deck centre one row before touchdown,
          positive when approaching (m/s)
        - `tangential_speed`: horizontal speed relative to the deck centre, one row before touchdown
          (m/s)
        - `slide`: largest distance from the touchdown point in the plane of the deck, over rows in
          contact (m)
        - `bounces`: number of times that contact with the vessel was lost and regained after
          touchdown
        - `landed_at_end`: true if there was a touchdown and the last row is in contact with a
          vessel
        - `final_lateral_error`: `lateral_error` at the last row (m); NaN unless `landed_at_end`
    """
    contact = result[f"{vehicle}.contact.vessel"].astype(bool)
    row = touchdown_row(result, vehicle)
    if row is None:
        reason = _no_touchdown(result, vehicle)
        unknown = ("time", "lateral_error", "touchdown_speed", "tangential_speed", "slide")
        return {
            **dict.fromkeys(unknown, reason),
            "bounces": 0,
            "landed_at_end": False,
            "final_lateral_error": reason,
        }
    distance = horizontal_distance(result, vehicle, deck)
    u, v, w = (
        result[f"{vehicle}.velocity.{axis}"] - result[f"{deck}.velocity.{axis}"] for axis in "xyz"
    )
    landed = bool(contact[-1])
    return {
        "time": float(result.time[row]),
        "lateral_error": float(distance[row]),
        "touchdown_speed": float(-w[row - 1]),
        "tangential_speed": math.hypot(u[row - 1], v[row - 1]),
        "slide": slide_distance(result, vehicle, deck, row),
        "bounces": int(np.count_nonzero(contact[row + 1 :] & ~contact[row:-1])),
        "landed_at_end": landed,
        "final_lateral_error": float(distance[-1])
        if landed
        else NoValue(f"{vehicle} does not touch a vessel at the end"),
    }


@better(
    lateral_error="lower",
    normal_speed="lower",
    tangential_speed="lower",
    kinetic_energy="lower",
    tilt="lower",
    peak_force="lower",
)
@units(
    forward_error="m",
    left_error="m",
    lateral_error="m",
    normal_speed="m/s",
    tangential_speed="m/s",
    kinetic_energy="J",
    tilt="rad",
    deck_roll="rad",
    deck_pitch="rad",
    deck_heave="m",
    peak_force="N",
)
def touchdown(result: Result, vehicle: Prefix, deck: Prefix, mass: float) -> dict[str, Number]:
    """Evaluate a touchdown in the axes of a deck that may roll, pitch, heave and turn.

    Touchdown is the row that `landing` finds. Speeds are those one row earlier, relative to the
    point of the deck below the vehicle.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the multirotor ("plant.uav").
        deck: Signal prefix of the landing deck ("plant.usv.deck").
        mass: Mass of the multirotor (kg).

    Returns:
        Values by name, all NaN without a touchdown:

        - `forward_error`, `left_error`: vehicle's centre of mass relative to the deck centre, along
          the deck's axes (m)
        - `lateral_error`: distance between the two in the plane of the deck (m)
        - `normal_speed`: speed along the normal of the deck, positive when approaching (m/s)
        - `tangential_speed`: speed in the plane of the deck (m/s)
        - `kinetic_energy`: mass / 2 times the squared relative speed (J)
        - `tilt`: angle between the up axes of vehicle and deck (rad)
        - `deck_roll`, `deck_pitch`: attitude of the vessel (rad)
        - `deck_heave`: height of the deck centre above its mean over all rows (m)
        - `peak_force`: largest contact force from touchdown on, each the mean over a step (N)
    """
    require(mass > 0, f"expected a positive mass (kg); found {mass:g}")
    row = touchdown_row(result, vehicle)
    if row is None:
        return dict.fromkeys(declared_units(touchdown), _no_touchdown(result, vehicle))
    vessel = deck.removesuffix(".deck")
    forward, left, _ = relative_position(result, vehicle, deck)[row].tolist()
    u, v, w = relative_velocity(result, vehicle, deck)[row - 1].tolist()
    height = result[f"{deck}.position.z"]
    return {
        "forward_error": forward,
        "left_error": left,
        "lateral_error": math.hypot(forward, left),
        "normal_speed": -w,
        "tangential_speed": math.hypot(u, v),
        "kinetic_energy": mass / 2 * (u**2 + v**2 + w**2),
        "tilt": float(relative_tilt(result, vehicle, deck)[row]),
        "deck_roll": float(result[f"{vessel}.attitude.roll"][row]),
        "deck_pitch": float(result[f"{vessel}.attitude.pitch"][row]),
        "deck_heave": float((height[row] - height).mean()),
        "peak_force": float(result[f"{vehicle}.contact.force"][row:].max()),
    }


@better(time_to_land="lower", aborts="lower")
@units(time_to_land="s")
def descent(result: Result, vehicle: Prefix, mode: Signal, descending: float) -> dict[str, Number]:
    """Evaluate the descent to the deck from the flight mode.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the multirotor ("plant.uav").
        mode: Signal with the flight mode ("uav.mode").
        descending: Value of `mode` during the descent; lower values are modes before it.

    Returns:
        Values by name:

        - `time_to_land`: time from the first row in the mode `descending` to the touchdown that
          `landing` finds, aborted descents included (s)
        - `aborts`: number of changes from the mode `descending` to a lower one
    """
    modes = result[mode]
    rows, row = np.flatnonzero(modes == descending), touchdown_row(result, vehicle)
    if row is None:
        duration: float = _no_touchdown(result, vehicle)
    elif not rows.size:
        duration = NoValue(f"{mode} is never {descending:g}, the mode of the descent")
    else:
        duration = float(result.time[row] - result.time[rows[0]])
    return {
        "time_to_land": duration,
        "aborts": int(np.count_nonzero((modes[:-1] == descending) & (modes[1:] < descending))),
    }


def _no_touchdown(result: Result, vehicle: str) -> NoValue:
    """Return the reason for which a result has no touchdown.

    No flight, or no contact with a vessel after one.
    """
    time, touching = result.time, result[f"{vehicle}.contact.touching"].astype(bool)
    contacts = np.concatenate((time[:1], time[touching], time[-1:]))
    if np.diff(contacts).max(initial=0.0) < MIN_FLIGHT_TIME:
        return NoValue(f"{vehicle} never took off, it is in contact during the whole run")
    return NoValue(f"{vehicle} touches no vessel after a flight")


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
