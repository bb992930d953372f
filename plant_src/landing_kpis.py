"""KPIs of a landing: touchdown, errors in the world and on the deck, descent.

They follow the conventions of `kpis.py`, by which scenarios name them
(`plant_src/kpis.py:landing`).
"""

from __future__ import annotations

import math

import numpy as np

from cosim.results import Result
from cosim.results.checks import Number
from cosim.results.kpi import NoValue, Prefix, Signal, better, declared_units, units
from cosim.results.signal_analysis import require

from . import deck_frame
from .recorded_motion import MIN_FLIGHT_TIME, horizontal_distance, touchdown_row


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
        return _values_without_landing(_no_touchdown(result, vehicle))
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
        "slide": deck_frame.slide_distance(result, vehicle, deck, row),
        "bounces": int(np.count_nonzero(contact[row + 1 :] & ~contact[row:-1])),
        "landed_at_end": landed,
        "final_lateral_error": float(distance[-1])
        if landed
        else NoValue(f"{vehicle} does not touch a vessel at the end"),
    }


def _values_without_landing(reason: NoValue) -> dict[str, Number]:
    unknown = ("time", "lateral_error", "touchdown_speed", "tangential_speed", "slide")
    return {
        **dict.fromkeys(unknown, reason),
        "bounces": 0,
        "landed_at_end": False,
        "final_lateral_error": reason,
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
