"""Motion of a vessel after an order to rudder or engine, for the KPIs of manoeuvres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cosim.core.errors import InputError
from cosim.results import Result
from cosim.results.signal_analysis import first_crossing_time

Point = Sequence[float]
CENTRE_OF_MASS: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Track:
    """Motion of a vessel from the order on.

    Arrays of shape (rows,), the first row at the time of the order.
    """

    #: time of the result (s)
    time: np.ndarray
    #: position relative to that at the order, complex: along the original course + i * to the left
    #: of it (m)
    position: np.ndarray
    #: heading relative to the original course, counter-clockwise, not wrapped (rad)
    heading_change: np.ndarray
    #: length of the track since the order (m)
    distance: np.ndarray

    def interpolate(self, values: np.ndarray, time: float) -> complex:
        """Return `values` (rows,), real or complex, at `time` (s); NaN if `time` is NaN."""
        return (
            complex(np.interp(time, self.time, values))
            if math.isfinite(time)
            else complex(math.nan, math.nan)
        )

    def time_of_heading_change(self, angle: float) -> float:
        """Return the first time (s) at which the heading differs by `angle` (rad) from the original course."""
        return first_crossing_time(
            self.time, self.turn_direction(angle) * self.heading_change, angle
        )

    def turn_direction(self, angle: float) -> int:
        """Return 1 if the heading first differs by `angle` (rad) to port, -1 if to starboard."""
        beyond = self.heading_change[np.abs(self.heading_change) >= angle]
        return -1 if beyond.size and beyond[0] < 0 else 1


def track(result: Result, vehicle: str, start: float, midships: Point = CENTRE_OF_MASS) -> Track:
    """Return the motion of a vessel from the order on.

    Args:
        result: Recorded run.
        vehicle: Signal prefix of the vessel ("plant.usv").
        start: Time of the order (s).
        midships: Point whose position is evaluated, relative to the centre of mass (m, body frame).

    Returns:
        The track; one row of NaN if the run ended before `start`.

    Raises:
        InputError: `start` is before the first row.
    """
    time = result.time
    if not time.size or start < time[0]:
        raise InputError(f"the manoeuvre starts at {start:g} s, before the first recorded row")
    if start > time[-1]:
        return Track(*(np.full(1, math.nan, dtype) for dtype in (float, complex, float, float)))
    later = time > start
    centre_of_mass = result[f"{vehicle}.position.x"] + 1j * result[f"{vehicle}.position.y"]
    position, heading = (
        np.concatenate([[np.interp(start, time, values)], values[later]])
        for values in (
            centre_of_mass + _point_offset(result, vehicle, midships),
            np.unwrap(result[f"{vehicle}.attitude.yaw"]),
        )
    )
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(position)))])
    ahead_and_left = (position - position[0]) * np.exp(-1j * heading[0])
    return Track(
        np.concatenate([[start], time[later]]), ahead_and_left, heading - heading[0], travelled
    )


def _point_offset(result: Result, vehicle: str, point: Point) -> np.ndarray:
    """Return the horizontal offset x + i * y (m, world) of a body-fixed point from the centre of mass, shape (rows,)."""
    if not any(point):
        return np.zeros(len(result.time), complex)
    w, x, y, z = (result[f"{vehicle}.orientation.{axis}"] for axis in "wxyz")
    ahead = 1 - 2 * (y * y + z * z) + 2j * (x * y + w * z)
    left = 2 * (x * y - w * z) + 1j * (1 - 2 * (x * x + z * z))
    up = 2 * (x * z + w * y) + 2j * (y * z - w * x)
    return np.asarray(point[0] * ahead + point[1] * left + point[2] * up)
