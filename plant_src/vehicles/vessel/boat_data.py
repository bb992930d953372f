"""Reader of what the files of both families of vessels have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...json_reader import JsonPath
from ..common.shapes import Vector
from ..common.vehicle_reader import Collision, CollisionBox, VehicleReader
from .actuators import MIN_TIME_CONSTANT, Propeller, Rudder

#: required keys of both families
KEYS = ("mass", "added_mass", "linear_damping", "propellers", "boxes", "crash_speed")
OPTIONAL_KEYS = (
    *(
        "centre_of_mass",
        "coriolis_added_mass",
        "air_drag",
        "air_centre",
        "deck_centre",
        "propeller",
        "rudders",
        "water_density",
    ),
)
_PROPELLER_QUANTITIES = {
    "thrust_coefficient": "N.s2/rad2",
    "reverse_thrust_coefficient": "N.s2/rad2",
    "max_speed": "rad/s",
    "max_reverse_speed": "rad/s",
    "time_constant": "s",
    "radius": "m",
    "advance_coefficient": "kg/rad",
    "max_azimuth": "rad",
}
#: quantities of a propeller whose default is another one
_PROPELLER_DEFAULTS = {
    "reverse_thrust_coefficient": "thrust_coefficient",
    "max_reverse_speed": "max_speed",
}
_REQUIRED_OF_PROPELLERS = ("thrust_coefficient", "max_speed")
_RUDDER_KEYS = ("position", "area")
_RUDDER_OPTIONAL_KEYS = ("label", "max_lift_coefficient", "stall_angle", "max_angle", "propeller")


class BoatReader(VehicleReader):
    """Reader of vessel data; `velocities` are the names of the elements of nu."""

    def __init__(self, velocities: Sequence[str]):
        super().__init__()
        self.velocities = velocities

    def read_boat(self, data: Mapping[str, Any], boxes: Sequence[Collision]) -> dict[str, Any]:
        """Read the attributes of `boat.Boat` without its name."""
        count = len(self.velocities)
        added = self.read_matrix(data.get("added_mass", [1.0] * count), ("added_mass",))
        centre = self.read_point(data, "centre_of_mass", (0.0, 0.0, 0.0))
        x, y = self.vector_quantity(data.get("air_drag", [0.0, 0.0]), ("air_drag",), "kg/m", "xy")
        if min(x, y) < 0:
            self.add_problem(("air_drag",), f"found {[x, y]}, expected numbers of at least 0")
        coriolis = (
            self.read_matrix(data["coriolis_added_mass"], ("coriolis_added_mass",))
            if "coriolis_added_mass" in data
            else added
        )
        return {
            "mass": self.quantity(data.get("mass", 1.0), ("mass",), "kg", above=0.0),
            "centre_of_mass": centre,
            "added_mass": added,
            "coriolis_added_mass": coriolis,
            "linear_damping": self.read_matrix(
                data.get("linear_damping", [1.0] * count), ("linear_damping",)
            ),
            "air_drag": (x, y),
            "air_centre": self.read_point(data, "air_centre", centre),
            "deck_centre": self.read_point(data, "deck_centre", _highest_top(boxes)),
            "propellers": self.read_propellers(data),
            "rudders": [
                self.read_rudder(each, ("rudders", str(i)))
                for i, each in self.read_rudder_list(data)
            ],
            "water_density": self.quantity(
                data.get("water_density", 1025.0), ("water_density",), "kg/m3", above=0.0
            ),
        }

    def read_point(self, data: Mapping[str, Any], key: str, default: Vector) -> Vector:
        """Read a point (m, body frame from O)."""
        x, y, z = self.vector_quantity(data.get(key, list(default)), (key,), "m", "xyz")
        return x, y, z

    def read_matrix(self, value: Any, path: JsonPath) -> np.ndarray:
        """Read the diagonal of a matrix, or its rows."""
        numbers, axes = self.si_value(value, path, "1"), self.velocities
        if (
            isinstance(numbers, list)
            and len(numbers) == len(axes)
            and all(isinstance(row, list) for row in numbers)
        ):
            return np.array(
                [self.vector(row, (*path, str(i)), axes) for i, row in enumerate(numbers)]
            )
        return np.diag(self.vector(numbers, path, axes))

    def read_propellers(self, data: Mapping[str, Any]) -> list[Propeller]:
        """Read all propellers; what they have in common is in "propeller"."""
        common = self.read_data(
            data.get("propeller", {}), ("propeller",), (), tuple(_PROPELLER_QUANTITIES)
        )
        return [
            self.read_propeller(common, each, ("propellers", str(i)))
            for i, each in self.elements(data, "propellers")
        ]

    def read_propeller(self, common: Mapping[str, Any], value: Any, path: JsonPath) -> Propeller:
        """Read one propeller; its quantities replace those of all propellers."""
        data = self.read_data(value, path, ("position",), ("label", "axis", *_PROPELLER_QUANTITIES))
        numbers: dict[str, float] = {}
        for key, unit in _PROPELLER_QUANTITIES.items():
            if key in _REQUIRED_OF_PROPELLERS and key not in {*data, *common}:
                self.add_missing(path, key, "propeller")
            place, source = ((*path, key), data) if key in data else (("propeller", key), common)
            default = numbers[_PROPELLER_DEFAULTS[key]] if key in _PROPELLER_DEFAULTS else 0.0
            limit = (
                {"above": 0.0} if key in _REQUIRED_OF_PROPELLERS and key in source else {"low": 0.0}
            )
            numbers[key] = self.quantity(source.get(key, default), place, unit, **limit)
            if key == "time_constant" and 0 < numbers[key] < MIN_TIME_CONSTANT:
                self.add_problem(
                    place,
                    f"found {numbers[key]}, expected 0 (no lag) or at least {MIN_TIME_CONSTANT}",
                )
        x, y, z = self.vector_quantity(
            data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz"
        )
        label = self.text(data.get("label", f"propeller {int(path[-1]) + 1}"), (*path, "label"))
        return Propeller(
            label,
            (x, y, z),
            self.read_axis(data.get("axis", [1.0, 0.0, 0.0]), (*path, "axis")),
            **numbers,
        )

    def read_rudder_list(self, data: Mapping[str, Any]) -> list[tuple[int, Any]]:
        """Return the rudders with their indices; a vessel may have none."""
        return self.elements(data, "rudders") if data.get("rudders") != [] else []

    def read_rudder(self, value: Any, path: JsonPath) -> Rudder:
        """Read one rudder."""
        data = self.read_data(value, path, _RUDDER_KEYS, _RUDDER_OPTIONAL_KEYS)
        x, y, z = self.vector_quantity(
            data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz"
        )
        right_angle = math.pi / 2
        return Rudder(
            self.text(data.get("label", f"rudder {int(path[-1]) + 1}"), (*path, "label")),
            (x, y, z),
            self.quantity(data.get("area", 1.0), (*path, "area"), "m2", above=0.0),
            self.quantity(
                data.get("max_lift_coefficient", 1.2),
                (*path, "max_lift_coefficient"),
                "1",
                above=0.0,
            ),
            self.quantity(
                data.get("stall_angle", math.radians(30)),
                (*path, "stall_angle"),
                "rad",
                0.01,
                right_angle,
            ),
            self.quantity(
                data.get("max_angle", math.radians(35)),
                (*path, "max_angle"),
                "rad",
                0.0,
                right_angle,
            ),
            self.integer(data.get("propeller", 0), (*path, "propeller"), 0),
        )


def _highest_top(boxes: Sequence[Collision]) -> Vector:
    """Return the centre of the top of the highest box."""
    box = max(
        boxes,
        key=lambda box: box.position[2] + box.size[2] / 2,
        default=CollisionBox((0.0,) * 3, (0.0,) * 3, 0.0),
    )
    x, y, z = box.position
    return x, y, z + box.size[2] / 2
