"""Figures of merit of a mission: how it landed, which waypoints it reached, how well it followed, whether it switched off.

Every function takes a result and names of things in it ("plant.uav", "plant.usv.deck") and returns its numbers by name; what
did not happen in a run is NaN or False. SI units; horizontal distances are those in the x-y plane of the world. All values
are those at recorded rows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import Prefix, Signal, better, declared_units, units

from . import deck_frame

#: A vehicle without any contact for this long (s) flies; a start some millimetres above its support or a bounce does not.
MIN_FLIGHT_TIME = 0.1


@better(
    lateral_error="lower",
    touchdown_speed="lower",
    tangential_speed="lower",
    slide="lower",
    bounces="lower",
    landed_at_end="higher",
    final_lateral_error="lower",
)
@units(time="s", lateral_error="m", touchdown_speed="m/s", tangential_speed="m/s", slide="m", final_lateral_error="m")
def landing(result: Result, vehicle: Prefix, deck: Prefix) -> dict[str, Number]:
    """The landing of `vehicle` on a vessel whose landing deck is `deck` ("plant.usv.deck").

    Touchdown is the first row with contact between the vehicle and a vessel after the vehicle flew.

    time                 s    of the touchdown
    lateral_error        m    horizontal distance of the vehicle's centre of mass from the deck centre at touchdown
    touchdown_speed      m/s  speed of the vehicle towards the deck (relative, vertical, > 0 approaching), one row earlier
    tangential_speed     m/s  horizontal speed relative to the deck centre, one row earlier
    slide                m    largest distance from the touchdown point in the plane of the deck, while in contact
    bounces              1    how often contact with the vessel was lost and regained after touchdown
    landed_at_end             whether there was a touchdown and the last row is in contact with a vessel
    final_lateral_error  m    as lateral_error, at the last row; NaN unless landed_at_end
    """
    contact = result[f"{vehicle}.contact.vessel"].astype(bool)
    row = touchdown_row(result, vehicle)
    if row is None:
        return _values_without_landing()
    distance = horizontal_distance(result, vehicle, deck)
    u, v, w = (result[f"{vehicle}.velocity.{axis}"] - result[f"{deck}.velocity.{axis}"] for axis in "xyz")
    landed = bool(contact[-1])
    return {
        "time": float(result.time[row]),
        "lateral_error": float(distance[row]),
        "touchdown_speed": float(-w[row - 1]),
        "tangential_speed": math.hypot(u[row - 1], v[row - 1]),
        "slide": _slide(result, vehicle, deck, row),
        "bounces": int(np.count_nonzero(contact[row + 1 :] & ~contact[row:-1])),
        "landed_at_end": landed,
        "final_lateral_error": float(distance[-1]) if landed else math.nan,
    }


def _values_without_landing() -> dict[str, Number]:
    unknown = ("time", "lateral_error", "touchdown_speed", "tangential_speed", "slide")
    return {**dict.fromkeys(unknown, math.nan), "bounces": 0, "landed_at_end": False, "final_lateral_error": math.nan}


def touchdown_row(result: Result, vehicle: str) -> int | None:
    """Row of the first contact of `vehicle` with a vessel after it flew (see FLIGHT_TIME), None when there is none."""
    time, touching = result.time, result[f"{vehicle}.contact.touching"].astype(bool)
    last_contact = np.maximum.accumulate(np.where(touching, time, time[:1]))
    has_flown = np.logical_or.accumulate(time - last_contact >= MIN_FLIGHT_TIME - 1e-9)
    rows = np.flatnonzero(has_flown & result[f"{vehicle}.contact.vessel"].astype(bool))
    return int(rows[0]) if rows.size else None


def horizontal_distance(result: Result, first: str, second: str) -> np.ndarray:
    """Distance in m in the x-y plane between two things with a `position`, shape (rows,)."""
    x, y = (result[f"{first}.position.{axis}"] - result[f"{second}.position.{axis}"] for axis in "xy")
    return np.hypot(x, y)


def _slide(result: Result, vehicle: str, deck: str, row: int) -> float:
    """Largest distance from the place of row `row` in the plane of the deck, over rows in contact."""
    place = deck_frame.relative_position(result, vehicle, deck)[row:, :2]
    contact = result[f"{vehicle}.contact.vessel"].astype(bool)[row:]
    return float(np.linalg.norm(place - place[0], axis=1)[contact].max())


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
    """How `vehicle` of `mass` (kg) meets the landing deck of a vessel ("plant.usv.deck"), seen from the deck.

    Touchdown is that of `landing`. Speeds are those one row earlier, relative to the point of the deck below the vehicle.

    forward_error, left_error  m    place of the vehicle's centre of mass from the deck centre, along the deck's axes
    lateral_error              m    distance of the two from each other in the plane of the deck
    normal_speed               m/s  speed towards the deck along its normal, > 0 approaching
    tangential_speed           m/s  speed in the plane of the deck
    kinetic_energy             J    mass / 2 times the square of the relative speed
    tilt                       rad  angle between the up axes of vehicle and deck
    deck_roll, deck_pitch      rad  attitude of the vessel
    deck_heave                 m    height of the deck centre above its mean over all rows
    peak_force                 N    largest contact force from touchdown on, mean over a step
    """
    row = touchdown_row(result, vehicle)
    if row is None:
        return dict.fromkeys(declared_units(touchdown), math.nan)
    vessel = deck.removesuffix(".deck")
    forward, left, _ = deck_frame.relative_position(result, vehicle, deck)[row].tolist()
    u, v, w = deck_frame.relative_velocity(result, vehicle, deck)[row - 1].tolist()
    height = result[f"{deck}.position.z"]
    return {
        "forward_error": forward,
        "left_error": left,
        "lateral_error": math.hypot(forward, left),
        "normal_speed": -w,
        "tangential_speed": math.hypot(u, v),
        "kinetic_energy": mass / 2 * (u**2 + v**2 + w**2),
        "tilt": float(deck_frame.relative_tilt(result, vehicle, deck)[row]),
        "deck_roll": float(result[f"{vessel}.attitude.roll"][row]),
        "deck_pitch": float(result[f"{vessel}.attitude.pitch"][row]),
        "deck_heave": float((height[row] - height).mean()),
        "peak_force": float(result[f"{vehicle}.contact.force"][row:].max()),
    }


@better(time_to_land="lower", aborts="lower")
@units(time_to_land="s")
def descent(result: Result, vehicle: Prefix, mode: Signal, descending: float) -> dict[str, Number]:
    """How the way down went, told by the signal `mode`: `descending` is its value for that, lower ones come before it.

    time_to_land  s  from the first row in that mode to the touchdown of `landing`, aborted descents included
    aborts        1  how often a lower mode followed upon it
    """
    modes = result[mode]
    rows, row = np.flatnonzero(modes == descending), touchdown_row(result, vehicle)
    landed = row is not None and rows.size > 0
    return {
        "time_to_land": float(result.time[row] - result.time[rows[0]]) if landed else math.nan,
        "aborts": int(np.count_nonzero((modes[:-1] == descending) & (modes[1:] < descending))),
    }


@better(reached="higher", all_reached="higher", time="lower")
@units(time="s")
def waypoints(result: Result, vehicle: Prefix, x: Sequence[float], y: Sequence[float], radius: float) -> dict[str, Number]:
    """Whether `vehicle` came within `radius` (m) of the waypoints (`x`, `y`) (m, world), one after the other.

    reached      1  number of waypoints reached in order, from the first on
    all_reached     whether these are all
    time[1] ...  s  when each was reached (its circle entered, not before the waypoint ahead of it), NaN for the others
    """
    times, row = [math.nan] * len(x), 0
    position_x, position_y = result[f"{vehicle}.position.x"], result[f"{vehicle}.position.y"]
    for i, (waypoint_x, waypoint_y) in enumerate(zip(x, y, strict=True)):
        inside = np.hypot(position_x[row:] - waypoint_x, position_y[row:] - waypoint_y) <= radius
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
def cross_track(result: Result, vehicle: Prefix, x: Sequence[float], y: Sequence[float], radius: float) -> dict[str, Number]:
    """How far `vehicle` was from the straight legs between its place in the first row and the waypoints (see `waypoints`).

    A leg begins when the waypoint before it is reached, and ends when its own is, or with the last row; the distance is that
    from the endless line through both ends of the leg, horizontally.

    rms         m  over all rows of all legs
    max         m  largest distance
    leg[1] ...  m  largest distance on each leg, NaN for those that were not begun
    """
    times = [value for key, value in waypoints(result, vehicle, x, y, radius).items() if key.startswith("time")]
    place = result[f"{vehicle}.position.x"] + 1j * result[f"{vehicle}.position.y"]
    corners = [place[0], *(east + 1j * north for east, north in zip(x, y, strict=True))]
    begin, legs = float(result.time[0]), []
    for start, end, reached in zip(corners, corners[1:], times, strict=False):
        rows = (result.time >= begin) & ~(result.time > reached)  # NaN: not reached, until the last row
        legs.append(_distance_from_line(place[rows], start, end))
        begin = reached  # NaN: the legs that follow have no rows
    all_legs = np.concatenate(legs)
    return {
        "rms": float(np.sqrt(np.mean(all_legs**2))),
        "max": float(all_legs.max()),
        **{f"leg[{i}]": float(leg.max()) if leg.size else math.nan for i, leg in enumerate(legs, start=1)},
    }


def _distance_from_line(place: np.ndarray, start: complex, end: complex) -> np.ndarray:
    """Distance (m) of places x + iy from the line through two points, or from the point when they are one."""
    way = end - start
    return np.abs(((place - start) * np.conj(way)).imag) / abs(way) if way else np.abs(place - start)


@better(rms="lower", max="lower")
@units(rms="m", max="m")
def tracking(result: Result, vehicle: Prefix, target: Prefix, start: float, stop: float = math.inf) -> dict[str, Number]:
    """How well `vehicle` stayed above `target` ("plant.usv" or "plant.usv.deck") over start <= time <= stop (s).

    rms  m  root of the mean squared horizontal distance over the rows
    max  m  largest horizontal distance
    """
    distance = horizontal_distance(result, vehicle, target)[(result.time >= start) & (result.time <= stop)]
    if not distance.size:
        return {"rms": math.nan, "max": math.nan}
    return {"rms": float(np.sqrt(np.mean(distance**2))), "max": float(distance.max())}


@better(stopped_at_end="higher")
@units(stop_time="s", final_speed="rad/s", max_speed="rad/s")
def motors(result: Result, rotor_speed: Prefix, threshold: float = 1.0) -> dict[str, Number]:
    """Whether the motors were switched off: the commands `rotor_speed`[1], [2], ... ("uav.mixer.rotor_speed"), in rad/s.

    stopped_at_end         whether the last row's commands are all below `threshold` (rad/s)
    stop_time       s      from when on they all stay below it, NaN unless stopped_at_end
    final_speed     rad/s  largest command in the last row
    max_speed       rad/s  largest command of the run
    """
    names = result.signals(f"{rotor_speed}[*]") or [f"{rotor_speed}[1]"]
    fastest = np.max([np.abs(result[name]) for name in names], axis=0)
    running = np.flatnonzero(fastest >= threshold)
    first_stopped = int(running[-1]) + 1 if running.size else 0
    stopped = first_stopped < len(fastest)
    return {
        "stopped_at_end": stopped,
        "stop_time": float(result.time[first_stopped]) if stopped else math.nan,
        "final_speed": float(fastest[-1]),
        "max_speed": float(fastest.max()),
    }


@units(value="{signal}")
def final(result: Result, signal: Signal) -> dict[str, float]:
    """`value`: the last value of one signal, in its own unit."""
    return {"value": result[signal][-1].item()}
