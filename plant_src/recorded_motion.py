"""Quantities of a recorded mission that KPIs, figures and the scene share.

The motion of a vehicle relative to a landing deck is given in the axes of the deck. These are those
of the vessel: forward, left, and up along the normal of the deck. Arrays have one row per row of
the result.
"""

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
    """Return the horizontal distance (m) between two signal prefixes, shape (rows,).

    Both have a `position` (m).
    """
    x, y = (
        result[f"{first}.position.{axis}"] - result[f"{second}.position.{axis}"] for axis in "xy"
    )
    distance: np.ndarray = np.hypot(x, y)
    return distance


def distance_from_line(position: np.ndarray, start: complex, end: complex) -> np.ndarray:
    """Return the distance (m) of positions x + iy from the line through two points.

    If the points coincide, it is the distance from them.
    """
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


def rotation_matrix(result: Result, vehicle: str) -> np.ndarray:
    """Return the rotations Rz(yaw) Ry(pitch) Rx(roll), body to world, shape (rows, 3, 3)."""
    roll, pitch, yaw = (result[f"{vehicle}.attitude.{angle}"] for angle in ("roll", "pitch", "yaw"))
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(angle), np.sin(angle)) for angle in (roll, pitch, yaw))
    matrix = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(matrix, dtype=np.float64), 2, 0)


def relative_position(result: Result, vehicle: str, deck: str) -> np.ndarray:
    """Return the position of a vehicle relative to the deck (m, deck axes), shape (rows, 3).

    It is that of the centre of mass from the centre of the deck.
    """
    return _to_deck_axes(result, deck, _world_offset(result, vehicle, deck))


def relative_velocity(result: Result, vehicle: str, deck: str) -> np.ndarray:
    """Return the velocity of a vehicle relative to the deck (m/s, deck axes), shape (rows, 3).

    It is relative to the point of the deck below the vehicle.
    """
    vessel = deck.removesuffix(".deck")
    rates_body = np.stack([result[f"{vessel}.rates.{axis}"] for axis in "pqr"], axis=1)
    rates = np.einsum("nij,nj->ni", rotation_matrix(result, vessel), rates_body)
    point = _vector_signal(result, f"{deck}.velocity") + np.cross(
        rates, _world_offset(result, vehicle, deck)
    )
    return _to_deck_axes(result, deck, _vector_signal(result, f"{vehicle}.velocity") - point)


def relative_tilt(result: Result, vehicle: str, deck: str) -> np.ndarray:
    """Return the angle between the up axes of vehicle and deck (rad), shape (rows,)."""
    up, normal = (
        rotation_matrix(result, name)[:, :, 2] for name in (vehicle, deck.removesuffix(".deck"))
    )
    angle: np.ndarray = np.arctan2(
        np.linalg.norm(np.cross(up, normal), axis=1), np.sum(up * normal, axis=1)
    )
    return angle


def slide_distance(result: Result, vehicle: str, deck: str, row: int) -> float:
    """Return the largest distance that a vehicle slides over a deck.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.uav").
        deck: Signal prefix of the landing deck ("plant.usv.deck").
        row: Row of the touchdown.

    Returns:
        Largest distance in the plane of the deck from the position at `row`, over rows in contact
        from then on (m).
    """
    position = relative_position(result, vehicle, deck)[row:, :2]
    contact = result[f"{vehicle}.contact.vessel"].astype(bool)[row:]
    return float(np.linalg.norm(position - position[0], axis=1)[contact].max())


def _to_deck_axes(result: Result, deck: str, vectors: np.ndarray) -> np.ndarray:
    rotated: np.ndarray = np.einsum(
        "nji,nj->ni", rotation_matrix(result, deck.removesuffix(".deck")), vectors
    )
    return rotated


def _world_offset(result: Result, vehicle: str, deck: str) -> np.ndarray:
    offset: np.ndarray = _vector_signal(result, f"{vehicle}.position") - _vector_signal(
        result, f"{deck}.position"
    )
    return offset


def _vector_signal(result: Result, name: str) -> np.ndarray:
    return np.stack([result[f"{name}.{axis}"] for axis in "xyz"], axis=1)
