"""Motion of a vehicle relative to the landing deck of a vessel, from a recorded result.

The axes of the deck are those of the vessel's body frame: forward, left, up. A deck is named by the prefix of its signals, for
example "plant.usv.deck". Arrays have one row per row of the result, shape (rows, 3) unless stated otherwise.
"""

from __future__ import annotations

import numpy as np

from cosim.results import Result


def rotation_matrix(result: Result, vehicle: str) -> np.ndarray:
    """Return the rotation matrices body to world frame, Rz(yaw) Ry(pitch) Rx(roll), shape (rows, 3, 3)."""
    roll, pitch, yaw = (result[f"{vehicle}.attitude.{angle}"] for angle in ("roll", "pitch", "yaw"))
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(angle), np.sin(angle)) for angle in (roll, pitch, yaw))
    matrix = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(matrix, dtype=np.float64), 2, 0)


def relative_position(result: Result, vehicle: str, deck: str) -> np.ndarray:
    """Return the vehicle's centre of mass relative to the deck centre (m, deck axes)."""
    return _to_deck_axes(result, deck, _world_offset(result, vehicle, deck))


def relative_velocity(result: Result, vehicle: str, deck: str) -> np.ndarray:
    """Return the vehicle's velocity relative to the deck-fixed point at its centre of mass (m/s, deck axes)."""
    vessel = deck.removesuffix(".deck")
    rates_body = np.stack([result[f"{vessel}.rates.{axis}"] for axis in "pqr"], axis=1)
    rates = np.einsum("nij,nj->ni", rotation_matrix(result, vessel), rates_body)
    point = _vector_signal(result, f"{deck}.velocity") + np.cross(rates, _world_offset(result, vehicle, deck))
    return _to_deck_axes(result, deck, _vector_signal(result, f"{vehicle}.velocity") - point)


def relative_tilt(result: Result, vehicle: str, deck: str) -> np.ndarray:
    """Return the angle between the up axes of vehicle and deck (rad), shape (rows,)."""
    up, normal = (rotation_matrix(result, name)[:, :, 2] for name in (vehicle, deck.removesuffix(".deck")))
    tilt: np.ndarray = np.arctan2(np.linalg.norm(np.cross(up, normal), axis=1), np.sum(up * normal, axis=1))
    return tilt


def _to_deck_axes(result: Result, deck: str, vectors: np.ndarray) -> np.ndarray:
    in_deck_axes: np.ndarray = np.einsum("nji,nj->ni", rotation_matrix(result, deck.removesuffix(".deck")), vectors)
    return in_deck_axes


def _world_offset(result: Result, vehicle: str, deck: str) -> np.ndarray:
    offset: np.ndarray = _vector_signal(result, f"{vehicle}.position") - _vector_signal(result, f"{deck}.position")
    return offset


def _vector_signal(result: Result, name: str) -> np.ndarray:
    return np.stack([np.asarray(result[f"{name}.{axis}"]) for axis in "xyz"], axis=1)
