"""Figures of merit of a mission: how it landed, which waypoints it reached, how well it followed, whether it switched off.

Every function takes a result and names of things in it ("plant.uav", "plant.usv.deck") and returns its numbers by name; what
did not happen in a run is NaN or False. SI units; horizontal distances are those in the x-y plane of the world. All values
are those at recorded rows.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from cosim.kpi import Number, units
from cosim.results import Result

#: A vehicle without any contact for this long (s) flies; a start some millimetres above its support or a bounce does not.
FLIGHT_TIME = 0.1


@units(time="s", lateral_error="m", touchdown_speed="m/s", tangential_speed="m/s", slide="m", final_lateral_error="m")
def landing(result: Result, vehicle: str, deck: str) -> dict[str, Number]:
    """The landing of `vehicle` on a vessel whose landing deck is `deck` ("plant.usv.deck").

    Touchdown is the first row with contact between the vehicle and a vessel after the vehicle flew.

    time                 s    of the touchdown
    lateral_error        m    horizontal distance of the vehicle's centre of mass from the deck centre at touchdown
    touchdown_speed      m/s  speed of the vehicle towards the deck (relative, vertical, > 0 approaching), one row earlier
    tangential_speed     m/s  horizontal speed relative to the deck centre, one row earlier
    slide                m    largest horizontal distance from the touchdown point, as seen from the deck, while in contact
    bounces              1    how often contact with the vessel was lost and regained after touchdown
    landed_at_end             whether there was a touchdown and the last row is in contact with a vessel
    final_lateral_error  m    as lateral_error, at the last row; NaN unless landed_at_end
    """
    contact = result[f"{vehicle}.contact.vessel"].astype(bool)
    row = touchdown_row(result, vehicle)
    if row is None:
        return _not_landed()
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


def _not_landed() -> dict[str, Number]:
    unknown = ("time", "lateral_error", "touchdown_speed", "tangential_speed", "slide")
    return {**dict.fromkeys(unknown, math.nan), "bounces": 0, "landed_at_end": False, "final_lateral_error": math.nan}


def touchdown_row(result: Result, vehicle: str) -> int | None:
    """Row of the first contact of `vehicle` with a vessel after it flew (see FLIGHT_TIME), None when there is none."""
    time, touching = result.time, result[f"{vehicle}.contact.touching"].astype(bool)
    last_contact = np.maximum.accumulate(np.where(touching, time, time[:1]))
    has_flown = np.logical_or.accumulate(time - last_contact >= FLIGHT_TIME - 1e-9)
    rows = np.flatnonzero(has_flown & result[f"{vehicle}.contact.vessel"].astype(bool))
    return int(rows[0]) if rows.size else None


def horizontal_distance(result: Result, first: str, second: str) -> np.ndarray:
    """Distance in m in the x-y plane between two things with a `position`, shape (rows,)."""
    x, y = (result[f"{first}.position.{axis}"] - result[f"{second}.position.{axis}"] for axis in "xy")
    return np.hypot(x, y)


def _slide(result: Result, vehicle: str, deck: str, row: int) -> float:
    """Largest distance from the place of row `row`, in the axes of the vessel that carries the deck, over rows in contact."""
    x, y = (result[f"{vehicle}.position.{axis}"] - result[f"{deck}.position.{axis}"] for axis in "xy")
    place = (x + 1j * y) * np.exp(-1j * result[f"{deck.removesuffix('.deck')}.attitude.yaw"])
    contact = result[f"{vehicle}.contact.vessel"].astype(bool)
    return float(np.abs(place[row:] - place[row])[contact[row:]].max())


@units(time="s")
def waypoints(result: Result, vehicle: str, x: Sequence[float], y: Sequence[float], radius: float) -> dict[str, Number]:
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


@units(rms="m", max="m")
def tracking(result: Result, vehicle: str, target: str, start: float, stop: float = math.inf) -> dict[str, Number]:
    """How well `vehicle` stayed above `target` ("plant.usv" or "plant.usv.deck") over start <= time <= stop (s).

    rms  m  root of the mean squared horizontal distance over the rows
    max  m  largest horizontal distance
    """
    distance = horizontal_distance(result, vehicle, target)[(result.time >= start) & (result.time <= stop)]
    if not distance.size:
        return {"rms": math.nan, "max": math.nan}
    return {"rms": float(np.sqrt(np.mean(distance**2))), "max": float(distance.max())}


@units(stop_time="s", final_speed="rad/s", max_speed="rad/s")
def motors(result: Result, rotor_speed: str, threshold: float = 1.0) -> dict[str, Number]:
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


def final(result: Result, signal: str) -> dict[str, float]:
    """`value`: the last value of one signal, in its own unit."""
    return {"value": result[signal][-1].item()}
