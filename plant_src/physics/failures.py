"""Failures of vehicles, which stay true: crashed and ditched.

A collision is a crash if it can change the velocity of the vehicle by more than its crash speed.
The change is that of a perfectly inelastic collision of the two centres of mass: the relative
velocity before the step, times the mass of the other body over the mass of both. At a platform it
is the whole velocity. A vehicle that slides over a platform at speed has crashed, too. A multirotor
that touches something upside down, and a vessel that is upside down, have crashed. A multirotor is
ditched if its centre of mass is below the water and no vessel carries it.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..placement import VehiclePlacement
from ..vehicles.common.interface import MAY_FAIL
from .body import ContactBody

#: indices of the flags of a vehicle, in the order of its Boolean variables
TOUCHING, ON_VESSEL, CRASHED, DITCHED = range(4)
FLAG_COUNT = 4

_unpack_pose = struct.Struct("7d").unpack_from

#: function from x and y (m) to the height of the water surface there (m)
WaterLevel = Callable[[float, float], float]


class Failures:
    """Failures of all vehicles.

    Args:
        bodies: Contact body of each vehicle.
        vehicles: Settings of each vehicle.
        flags: All flags, shape (vehicles, FLAG_COUNT).
        step_status: Status of the last step of each vehicle.
        platform_names: Name of each platform by its number in Bullet.

    Attributes:
        alarm: Whether `examine` must be called after the step.
        permanent_flags: Flags of the failures alone, in the order of `flags`.
    """

    def __init__(
        self,
        bodies: Sequence[ContactBody],
        vehicles: Sequence[VehiclePlacement],
        flags: np.ndarray,
        step_status: np.ndarray,
        platform_names: Mapping[int, str],
    ):
        self._bodies, self._flags = bodies, flags
        # memoryviews: access to a few numbers is faster than with NumPy
        self._step_status: Any = step_status.data
        self._flag_data: Any = flags.reshape(-1).data
        self._outputs: list[Any] = [body.outputs.data for body in bodies]
        self.permanent_flags = np.zeros_like(flags)
        self.alarm = False
        self._names = {**platform_names, **{body.body_id: body.name for body in bodies}}
        self._indices = {body.body_id: k for k, body in enumerate(bodies)}
        self._masses = {
            body.body_id: vehicle.body.mass for body, vehicle in zip(bodies, vehicles, strict=True)
        }
        self._crash_speeds = [vehicle.crash_speed for vehicle in vehicles]
        self._messages: list[str] = []

    def largest_harmless_speed(self, pair: tuple[int, int]) -> float:
        """Return the relative speed (m/s) above which one of two colliding bodies has crashed."""
        limits = [
            self._crash_speeds[self._indices[body]] / share
            for body, share in self._shares(pair)
            if body in self._indices
        ]
        return min(limits)

    def _shares(self, pair: tuple[int, int]) -> list[tuple[int, float]]:
        """Return the shares of the relative velocity that a collision takes from two bodies."""
        a, b = (self._masses.get(body, math.inf) for body in pair)
        share = b / (a + b) if math.isfinite(a) else 0.0
        if math.isinf(b):
            share = 1.0
        return [(pair[0], share), (pair[1], 1 - share)]

    def add_collision(self, pair: tuple[int, int], speed: float) -> None:
        """Record the crashes in a collision of two bodies with a relative speed (m/s)."""
        for (body, share), (other, _) in zip(
            self._shares(pair), self._shares(pair)[::-1], strict=True
        ):
            vehicle = self._indices.get(body)
            if vehicle is not None and share * speed > self._crash_speeds[vehicle]:
                text = (
                    f"collision with {self._names[other]} at {speed:.2f} m/s, limit "
                    f"{self._crash_speeds[vehicle] / share:.2f} m/s"
                )
                self._record(vehicle, CRASHED, text)

    def _record(self, vehicle: int, failure: int, text: str) -> None:
        if not self.permanent_flags[vehicle, failure]:
            self.permanent_flags[vehicle, failure] = self._flags[vehicle, failure] = True
            self._messages.append(
                f"{self._bodies[vehicle].name} {'crashed' if failure == CRASHED else 'ditched'}: "
                f"{text}"
            )
            self.alarm = True

    def examine(self, water_level: WaterLevel) -> list[str]:
        """Find ditched and capsized vehicles; return a message per failure since the last call."""
        for vehicle, status in enumerate(self._step_status):
            if status >= MAY_FAIL:
                self._examine(vehicle, water_level)
        messages, self._messages, self.alarm = self._messages, [], False
        return messages

    def _examine(self, vehicle: int, water_level: WaterLevel) -> None:
        is_touching, is_on_vessel, _, is_ditched = self._flag_data[
            FLAG_COUNT * vehicle : FLAG_COUNT * (vehicle + 1)
        ]
        x, y, z, _, qx, qy, _ = _unpack_pose(self._outputs[vehicle])
        is_vessel = self._bodies[vehicle].model.is_vessel
        if qx * qx + qy * qy > 0.5 and (is_vessel or is_touching):
            self._record(vehicle, CRASHED, "capsized" if is_vessel else "upside down in contact")
        if not (is_vessel or is_on_vessel or is_ditched) and z < (level := water_level(x, y)):
            self._record(vehicle, DITCHED, f"{level - z:.2f} m below the water")

    def restore(self, flags: np.ndarray) -> None:
        """Restore the failures from all flags of a saved state."""
        self.permanent_flags[:, CRASHED:] = flags[:, CRASHED:]
        self._messages, self.alarm = [], False
