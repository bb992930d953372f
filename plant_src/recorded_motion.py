"""Quantities of a recorded mission that KPIs, figures and the scene share."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cosim.results import Result
from cosim.results.signal_analysis import require

#: shortest time without contact that counts as flight (s); excludes bounces and a start some
#: millimetres above the support
MIN_FLIGHT_TIME = 0.1


def touchdown_row(result: Result, vehicle: str) -> int | None:
    """Return the row of the first contact between `vehicle` and a vessel after a flight.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the multirotor ("plant.uav").

    Returns:
        Row index, or None without a touchdown. A flight is at least `MIN_FLIGHT_TIME` without any
        contact.
    """
    time, touching = result.time, result[f"{vehicle}.contact.touching"].astype(bool)
    last_contact = np.maximum.accumulate(np.where(touching, time, time[:1]))
    has_flown = np.logical_or.accumulate(time - last_contact >= MIN_FLIGHT_TIME - 1e-9)
    rows = np.flatnonzero(has_flown & result[f"{vehicle}.contact.vessel"].astype(bool))
    return int(rows[0]) if rows.size else None


def horizontal_distance(result: Result, first: str, second: str) -> np.ndarray:
    """Return the distance in the x-y plane of the world between two signal prefixes with a `position` (m), shape (rows,)."""
    x, y = (
        result[f"{first}.position.{axis}"] - result[f"{second}.position.{axis}"] for axis in "xy"
    )
    distance: np.ndarray = np.hypot(x, y)
    return distance


def distance_from_line(position: np.ndarray, start: complex, end: complex) -> np.ndarray:
    """Return the distance (m) of positions x + iy from the line through two points, or from the point if they coincide."""
    direction = end - start
    distance: np.ndarray = (
        np.abs(((position - start) * np.conj(direction)).imag) / abs(direction)
        if direction
        else np.abs(position - start)
    )
    return distance


def used_waypoints(
    x: Sequence[float], y: Sequence[float], count: float | None
) -> list[tuple[float, float]]:
    """Return the first `count` waypoints as (x, y); None: all.

    An autopilot has more elements than it uses.
    """
    require(
        len(x) == len(y), f"expected as many waypoint_x as waypoint_y; found {len(x)} and {len(y)}"
    )
    waypoints = list(zip(x, y, strict=True))
    return waypoints if count is None else waypoints[: int(count)]
