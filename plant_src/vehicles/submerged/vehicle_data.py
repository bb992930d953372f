"""Reader of the data of a submerged vehicle: JSON to craft and collision boxes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.errors import InputError

from ...json_reader import JsonPath
from ..common.shapes import Body, Shape
from ..common.vehicle_reader import Collision, VehicleReader, boxes_in, edges_around
from .craft import Craft, Thruster
from .interface import MATRICES

#: sense of rotation at a positive speed, seen from the tip of the thrust's axis -> sign of the
#: reaction torque about this axis
TORQUE_SIGNS = {"clockwise": 1.0, "counter-clockwise": -1.0}

#: required keys of the file
KEYS = (
    *("mass", "inertia", "displaced_volume", "centre_of_buoyancy"),
    *(*MATRICES, "thruster", "thrusters", "boxes", "crash_speed"),
)
_OPTIONAL_KEYS = ("size", "gravity", "water_density")
_COEFFICIENTS = {
    "thrust_coefficient": "N.s2/rad2",
    "reverse_thrust_coefficient": "N.s2/rad2",
    "torque_coefficient": "N.m.s2/rad2",
}
#: required keys of all thrusters
THRUSTER_KEYS = ("radius", "max_speed")
_THRUSTER_OPTIONAL_KEYS = (*_COEFFICIENTS, "time_constant", "advance_coefficient")
_AXES = ("u", "v", "w", "p", "q", "r")


@dataclass(frozen=True)
class SubmergedData:
    """Data of a submerged vehicle: craft, collision boxes and crash speed (m/s)."""

    craft: Craft
    boxes: tuple[Collision, ...]
    crash_speed: float

    def body_with(self, mass: float, inertia: np.ndarray) -> Body:
        """Return the rigid body for Bullet with another mass (kg) and inertia tensor (kg m2).

        Raises InputError.
        """
        return replace(self.craft, mass=mass, inertia=inertia).body(self.boxes_in)

    def boxes_in(self, to_body: np.ndarray) -> tuple[Shape, ...]:
        """Return the boxes in the frame from which `to_body` (3, 3) rotates into the body frame."""
        return boxes_in(self.boxes, to_body)


def read_submerged(name: str, data: Mapping[str, Any], keys: tuple[str, ...]) -> SubmergedData:
    """Read the data of a submerged vehicle.

    Args:
        name: Name of the vehicle.
        data: JSON object (`plant_src/vehicles/data/README.md`).
        keys: Keys that vehicles of all families have.

    Raises:
        InputError: With all problems; the subject of each is the path of the value.
    """
    reader = _SubmergedReader()
    vehicle = reader.read_submerged(name, data, keys)
    if reader.problems or vehicle is None:
        raise InputError(reader.problems)
    return vehicle


class _SubmergedReader(VehicleReader):
    def read_submerged(self, name: str, data: Any, keys: tuple[str, ...]) -> SubmergedData | None:
        """Read all data; None if the craft is impossible."""
        data = self.read_data(data, (), KEYS, (*_OPTIONAL_KEYS, *keys))
        common = self.read_data(
            data.get("thruster"), ("thruster",), THRUSTER_KEYS, _THRUSTER_OPTIONAL_KEYS
        )
        boxes = self.read_boxes(data)
        values: dict[str, Any] = {
            **self.read_volume(data, boxes),
            **self.read_propulsion(common),
            **{
                matrix: self.read_matrix(data.get(matrix, [1.0] * 6), (matrix,))
                for matrix in MATRICES
            },
            "mass": self.quantity(data.get("mass", 1.0), ("mass",), "kg", above=0.0),
            "inertia": self.read_inertia(data.get("inertia", [1.0] * 3)),
            "thrusters": [
                self.read_thruster(common, each, ("thrusters", str(i)))
                for i, each in self.elements(data, "thrusters")
            ],
        }
        crash_speed = self.quantity(
            data.get("crash_speed", 1.0), ("crash_speed",), "m/s", above=0.0
        )
        if self.problems:
            return None
        return self.construct(lambda: SubmergedData(Craft(name, **values), boxes, crash_speed))

    def read_volume(self, data: Mapping[str, Any], boxes: tuple[Collision, ...]) -> dict[str, Any]:
        """Read what determines weight and buoyancy."""
        size = self.vector_quantity(
            data.get("size", list(edges_around(boxes))), ("size",), "m", "xyz"
        )
        if not min(size) > 0:
            self.add_problem(("size",), f"found {list(size)}, expected edges greater than 0")
        centre = data.get("centre_of_buoyancy", [0.0] * 3)
        volume = self.quantity(
            data.get("displaced_volume", 1.0), ("displaced_volume",), "m3", above=0.0
        )
        if not self.problems and volume > (box := math.prod(size)):
            text = (
                f"found {volume:g}, expected at most {box:.4g}, the volume of the box with the "
                f"edges {list(size)} m"
            )
            self.add_problem(("displaced_volume",), text)
        return {
            "displaced_volume": volume,
            "centre_of_buoyancy": self.vector_quantity(centre, ("centre_of_buoyancy",), "m", "xyz"),
            "size": size,
            "gravity": self.quantity(data.get("gravity", 9.81), ("gravity",), "m/s2", above=0.0),
            "water_density": self.quantity(
                data.get("water_density", 1025.0), ("water_density",), "kg/m3", above=0.0
            ),
        }

    def read_propulsion(self, common: Mapping[str, Any]) -> dict[str, float]:
        """Read what all thrusters have in common."""
        advance = common.get("advance_coefficient", 0.0)
        return {
            "max_thruster_speed": self.quantity(
                common.get("max_speed", 1.0), ("thruster", "max_speed"), "rad/s", above=0.0
            ),
            "thruster_radius": self.quantity(
                common.get("radius", 1.0), ("thruster", "radius"), "m", above=0.0
            ),
            "thruster_time_constant": self.quantity(
                common.get("time_constant", 0.0), ("thruster", "time_constant"), "s", low=0.0
            ),
            "advance_coefficient": self.quantity(
                advance, ("thruster", "advance_coefficient"), "kg/rad", low=0.0
            ),
        }

    def read_matrix(self, value: Any, path: JsonPath) -> np.ndarray:
        """Read the six diagonal elements of a matrix, or its six rows."""
        numbers = self.si_value(value, path, "1")
        if (
            isinstance(numbers, list)
            and len(numbers) == 6
            and all(isinstance(row, list) for row in numbers)
        ):
            return np.array(
                [self.vector(row, (*path, str(i)), _AXES) for i, row in enumerate(numbers)]
            )
        return np.diag(self.vector(numbers, path, _AXES))

    def read_thruster(self, common: Mapping[str, Any], value: Any, path: JsonPath) -> Thruster:
        """Read one thruster; its coefficients replace those of all thrusters."""
        data = self.read_data(value, path, ("position", "axis"), ("label", "turns", *_COEFFICIENTS))
        if "thrust_coefficient" not in {*data, *common}:
            self.add_missing(path, "thrust_coefficient", "thruster")
        coefficients: dict[str, float] = {}
        for key, unit in _COEFFICIENTS.items():
            place, source = ((*path, key), data) if key in data else (("thruster", key), common)
            default = coefficients.get("thrust_coefficient", 1.0) if "thrust" in key else 0.0
            coefficients[key] = self.quantity(source.get(key, default), place, unit, low=0.0)
        turns = self.choice(data.get("turns", "clockwise"), (*path, "turns"), tuple(TORQUE_SIGNS))
        if coefficients["torque_coefficient"] and "turns" not in data:
            self.add_problem(
                path,
                '"turns" is missing; a thruster with a torque_coefficient has a sense of rotation',
            )
        coefficients["torque_coefficient"] *= TORQUE_SIGNS[turns]
        x, y, z = self.vector_quantity(
            data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz"
        )
        label = self.text(data.get("label", f"thruster {int(path[-1]) + 1}"), (*path, "label"))
        return Thruster(
            label,
            (x, y, z),
            self.read_axis(data.get("axis", [1.0, 0.0, 0.0]), (*path, "axis")),
            **coefficients,
        )
