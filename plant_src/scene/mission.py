"""Poses of the vehicles of a recorded mission, as the scene draws them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.core.errors import InputError
from cosim.results import Result

from ..catalogue import models_of
from ..obstacles import Obstacle, obstacles_of
from ..recorded_motion import touchdown_row
from ..vehicles.common.shapes import Quaternion

APPROACH_TIME = 8.0  # s before touchdown that belong to the landing


@dataclass(frozen=True)
class Mission:
    """Result with its vehicles (signal prefix -> name or data of the vehicle), and platforms and obstacles of its plant."""

    result: Result
    vehicles: Mapping[str, Any]
    platforms: Mapping[str, Mapping[str, Sequence[float]]]
    obstacles: Sequence[Obstacle] = ()

    def position(self, vehicle: str, row: int) -> list[float]:
        """Return the position of a vehicle's centre of mass (m, world)."""
        return [float(self.result[f"{vehicle}.position.{axis}"][row]) for axis in "xyz"]

    def orientation(self, vehicle: str, row: int) -> Quaternion:
        """Return the orientation of a vehicle as unit quaternion (x, y, z, w), body to world."""
        x, y, z, w = (float(self.result[f"{vehicle}.orientation.{part}"][row]) for part in "xyzw")
        return x, y, z, w

    def _path(self, vehicle: str) -> np.ndarray:
        return np.stack([self.result[f"{vehicle}.position.{axis}"] for axis in "xyz"], axis=1)

    def positions(self) -> np.ndarray:
        """Return the positions of all vehicles (m, world), shape (vehicles, rows, 3)."""
        return np.stack([self._path(vehicle) for vehicle in self.vehicles])

    def _first_vehicle(self, is_vessel: bool) -> str:
        names = [
            name
            for name, model in self.vehicles.items()
            if next(iter(models_of(model).values())).is_vessel == is_vessel
        ]
        return names[0] if names else next(iter(self.vehicles))

    def vessel_positions(self) -> np.ndarray:
        """Return the positions of the first vessel, or of the first vehicle without a vessel (m, world), shape (rows, 3)."""
        return self._path(self._first_vehicle(is_vessel=True))

    def vessel_yaw(self, row: int) -> float:
        """Return the heading of the first vessel (rad, counter-clockwise from east)."""
        return float(self.result[f"{self._first_vehicle(is_vessel=True)}.attitude.yaw"][row])

    def landing_rows(self) -> range:
        """Return the rows of the last 8 s before touchdown, or of the last 8 s of a run without touchdown."""
        touchdown = touchdown_row(self.result, self._first_vehicle(is_vessel=False))
        last = len(self.result.time) - 1 if touchdown is None else touchdown
        first = int(np.searchsorted(self.result.time, self.result.time[last] - APPROACH_TIME))
        return range(first, last + 1)


def mission_of_result(result: Result) -> Mission:
    """Return the mission of a result.

    Raises InputError if its scenario has no plant with vehicles.
    """
    components: Mapping[str, Any] = result.metadata.get("scenario", {}).get("components", {})
    for name, component in components.items():
        arguments = component.get("arguments", {})
        if vehicles := arguments.get("vehicles"):
            models = {f"{name}.{vehicle}": spec["model"] for vehicle, spec in vehicles.items()}
            return Mission(result, models, arguments.get("platforms", {}), obstacles_of(arguments))
    raise InputError("the scene needs a result whose scenario has a plant with vehicles")
