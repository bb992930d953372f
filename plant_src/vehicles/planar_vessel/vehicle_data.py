"""Reader of the data of a planar vessel: JSON to vessel and collision boxes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.errors import InputError

from ..common.shapes import Body
from ..common.vehicle_reader import Collision, boxes_in
from ..vessel import boat_data
from ..vessel.boat_data import BoatReader
from .planar_vessel import PlanarVessel

#: required keys of the file
KEYS = (*boat_data.KEYS, "yaw_inertia")
_OPTIONAL_KEYS = (*boat_data.OPTIONAL_KEYS, "height", "quadratic_damping", "cubic_damping")
_VELOCITIES = ("u", "v", "r")


@dataclass(frozen=True)
class PlanarVesselData:
    """Data of a planar vessel: vessel, collision boxes and crash speed (m/s)."""

    vessel: PlanarVessel
    boxes: tuple[Collision, ...]
    crash_speed: float

    def body_with(self, mass: float, yaw_inertia: float) -> Body:
        """Return the rigid body for Bullet with another mass (kg) and moment of inertia (kg m2).

        Raises InputError.
        """
        return replace(self.vessel, mass=mass, yaw_inertia=yaw_inertia).body(
            boxes_in(self.boxes, np.eye(3))
        )


def read_planar_vessel(
    name: str, data: Mapping[str, Any], keys: tuple[str, ...]
) -> PlanarVesselData:
    """Read the data of a planar vessel.

    Args:
        name: Name of the vehicle.
        data: JSON object (`plant_src/vehicles/data/README.md`).
        keys: Keys that vehicles of all families have.

    Raises:
        InputError: With all problems; the subject of each is the path of the value.
    """
    reader = _PlanarVesselReader(_VELOCITIES)
    vessel = reader.read_vessel(name, data, keys)
    if reader.problems or vessel is None:
        raise InputError(reader.problems)
    return vessel


class _PlanarVesselReader(BoatReader):
    def read_vessel(self, name: str, data: Any, keys: tuple[str, ...]) -> PlanarVesselData | None:
        """Read all data; None if the vessel is impossible."""
        data = self.read_data(data, (), KEYS, (*_OPTIONAL_KEYS, *keys))
        boxes = self.read_boxes(data)
        a, b, c = self.vector_quantity(
            data.get("cubic_damping", [0.0] * 3), ("cubic_damping",), "1", _VELOCITIES
        )
        values: dict[str, Any] = {
            **self.read_boat(data, boxes),
            "yaw_inertia": self.quantity(
                data.get("yaw_inertia", 1.0), ("yaw_inertia",), "kg.m2", above=0.0
            ),
            "height": self.quantity(data.get("height", 0.0), ("height",), "m"),
            "quadratic_damping": self.read_quadratic_damping(
                data.get("quadratic_damping", [0.0] * 3)
            ),
            "cubic_damping": (a, b, c),
        }
        crash_speed = self.quantity(
            data.get("crash_speed", 1.0), ("crash_speed",), "m/s", above=0.0
        )
        if self.problems:
            return None
        return self.construct(
            lambda: PlanarVesselData(PlanarVessel(name=name, **values), boxes, crash_speed)
        )

    def read_quadratic_damping(self, value: Any) -> tuple[np.ndarray, ...]:
        """Read the matrices of |u|, |v| and |r|, or one matrix whose columns belong to |u| u, |v| v and |r| r."""
        path = ("quadratic_damping",)
        if isinstance(value, Mapping) and "value" not in value:
            data = self.read_data(value, path, (), _VELOCITIES)
            return tuple(
                self.read_matrix(data.get(letter, [0.0] * 3), (*path, letter))
                for letter in _VELOCITIES
            )
        matrix = self.read_matrix(value, path)
        return tuple(np.where(np.arange(3) == k, matrix, 0.0) for k in range(3))
