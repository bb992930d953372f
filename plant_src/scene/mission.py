"""Poses of the vehicles of a recorded mission, and named cameras that follow them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.core.errors import InputError
from cosim.results import Result

from ..catalogue import default_model
from ..placement import Obstacle, obstacles_of
from ..recorded_motion import touchdown_row
from ..vehicles.common.shapes import BODY_UP, Quaternion
from .solid_renderer import View

APPROACH_TIME = 8.0  # s before touchdown that belong to the landing
_UP = np.array(BODY_UP)


@dataclass(frozen=True)
class Mission:
    """Result with the vehicles, platforms and obstacles of its plant.

    `vehicles` maps the prefix of a vehicle's signals to its name in the catalogue, or its data.
    """

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
        for name, vehicle in self.vehicles.items():
            if default_model(vehicle).is_vessel == is_vessel:
                return name
        return next(iter(self.vehicles))

    def vessel_positions(self) -> np.ndarray:
        """Return the positions of the first vessel (m, world), shape (rows, 3).

        Without a vessel they are those of the first vehicle.
        """
        return self._path(self._first_vehicle(is_vessel=True))

    def vessel_yaw(self, row: int) -> float:
        """Return the heading of the first vessel (rad, counter-clockwise from east)."""
        return float(self.result[f"{self._first_vehicle(is_vessel=True)}.attitude.yaw"][row])

    def landing_rows(self) -> range:
        """Return the rows of the last 8 s before touchdown, or before the end without touchdown."""
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


def overview(mission: Mission, _row: int) -> View:
    """Return a fixed view of all paths from above in the south-east."""
    return _framing_view(mission.positions().reshape(-1, 3), np.array([0.45, -0.8, 0.27]), 0.8)


def chase(mission: Mission, row: int) -> View:
    """Return a view from the south that follows the vehicles; its distance grows with theirs."""
    positions = mission.positions()[:, row]
    centre = positions.mean(axis=0)
    spread = float(np.linalg.norm(positions - centre, axis=1).max())
    return View(centre + (2.4 + 1.3 * spread) * np.array([0.55, -1.0, 0.36]), centre)


def deck(mission: Mission, row: int) -> View:
    """Return a view of the landing deck from behind and above, fixed to the vessel."""
    position, yaw = mission.vessel_positions()[row], mission.vessel_yaw(row)
    heading = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    return View(position - 2.6 * heading + 1.5 * _UP, position + 0.2 * heading + 0.45 * _UP, 0.75)


def landing(mission: Mission, _row: int) -> View:
    """Return a fixed view from the side of the last seconds before touchdown."""
    rows = mission.landing_rows()
    positions = mission.positions()[:, rows].reshape(-1, 3)
    travel = mission.vessel_positions()[rows[-1]] - mission.vessel_positions()[rows[0]]
    side = np.array([travel[1], -travel[0], 0.0])
    length = float(np.linalg.norm(side))
    side = side / length if length > 0.5 else np.array([0.4, -0.92, 0.0])
    if side[1] > 0:  # look north, where the trees are
        side = -side
    return _framing_view(positions, side + 0.24 * _UP, 0.45)


def _framing_view(
    positions: np.ndarray, direction: np.ndarray, margin: float, angle: float = 0.6
) -> View:
    """Return a view from `direction` that shows all positions (n, 3) plus `margin` (m).

    The picture has the aspect ratio 2.
    """
    centre = (positions.min(axis=0) + positions.max(axis=0)) / 2
    away = direction / np.linalg.norm(direction)
    camera = View(centre + away, centre, angle).axes()
    right, up, forward = np.abs((positions - centre) @ camera.T).max(axis=0) + margin
    distance = max(up / math.tan(angle / 2), right / (2 * math.tan(angle / 2))) + forward
    return View(centre + distance * away, centre, angle)


CAMERAS: Mapping[str, Callable[[Mission, int], View]] = {
    "overview": overview,
    "chase": chase,
    "deck": deck,
    "landing": landing,
}
