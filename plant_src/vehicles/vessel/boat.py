"""Data of vessels that are given by JSON files, and their reader.

What the planar and the floating family have in common.

Body frame: x forward, y left, z up; its origin O is any point of the centre plane that the file
chooses. SI units. Matrices belong to (u, v, r) of a planar vessel and to (u, v, w, p, q, r) of a
floating one, about O.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import Problem
from cosim.core.json_values import JsonObject

from ...json_reader import JsonPath
from ..common.interface import attribute_parameters, matrix_parameter
from ..common.shapes import Vector, eigenvalue_problems, symmetry_problems
from ..common.vehicle_reader import Collision, CollisionBox, Vehicle, VehicleReader
from .actuators import MAX_PROPELLERS, MAX_RUDDERS, MIN_TIME_CONSTANT, Propeller, Rudder


@dataclass(frozen=True, kw_only=True)
class Boat(Vehicle):
    """A rigid body on the water with propellers and rudders.

    Attributes:
        centre_of_mass: Centre of mass from O (m).
        added_mass: Added mass M_A, shape (n, n).
        coriolis_added_mass: Part of M_A whose Coriolis loads the damping does not contain, shape
            (n, n).
        linear_damping: Matrix D of the load -D nu_r, shape (n, n).
        air_drag: Force over squared air velocity along x and y (kg/m).
        air_centre: Point at which this force acts (m).
        deck_centre: Centre of the top of the landing deck (m).
        propellers: All propellers, at most MAX_PROPELLERS.
        rudders: All rudders, at most MAX_RUDDERS.
        water_density: Density of the water (kg/m3).
    """

    kind = "vessel"
    centre_of_mass: Vector
    added_mass: np.ndarray
    coriolis_added_mass: np.ndarray
    linear_damping: np.ndarray
    air_drag: tuple[float, float]
    air_centre: Vector
    deck_centre: Vector
    propellers: Sequence[Propeller]
    rudders: Sequence[Rudder]
    water_density: float = 1025.0

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from super().problems()
        for name in ("added_mass", "coriolis_added_mass"):
            for text in symmetry_problems(getattr(self, name)):
                yield self.problem(text, name)
        for text in eigenvalue_problems(self.added_mass):
            yield self.problem(text, "added_mass")
        # published matrices also contain lift, off the diagonal
        diagonal = np.diag(self.linear_damping)
        if diagonal.min() < 0:
            text = f"found the diagonal {diagonal.tolist()}, expected numbers of at least 0"
            yield self.problem(text, "linear_damping")
        for name, most, least in (("propellers", MAX_PROPELLERS, 1), ("rudders", MAX_RUDDERS, 0)):
            if not least <= (count := len(getattr(self, name))) <= most:
                yield self.problem(f"found {count or 'none'}, expected {least} to {most}", name)
        for i, rudder in enumerate(self.rudders):
            if rudder.propeller > len(self.propellers):
                text = (
                    f"found {rudder.propeller}, expected the number of a propeller, 1 to "
                    f"{len(self.propellers)}"
                )
                yield self.problem(text, "rudders", str(i), "propeller")

    @property
    def slots(self) -> tuple[int, int]:
        """Numbers of propellers and rudders."""
        return len(self.propellers), len(self.rudders)


def boat_parameters(boat: Boat, velocities: str) -> Iterator[Variable]:
    """Yield the parameters of both families; `velocities` are the names of the elements of nu."""
    yield from attribute_parameters(boat, _MASS_PARAMETERS)
    for name, text in (
        ("added_mass", "added mass about O"),
        ("coriolis_added_mass", "added mass in the Coriolis loads"),
        ("linear_damping", "load over velocity relative to the water"),
    ):
        yield matrix_parameter(name, f"{text}, for {velocities}", getattr(boat, name))
    yield from attribute_parameters(boat, _AIR_PARAMETERS)


#: attribute, and name, unit, smallest value and description of its parameter
_MASS_PARAMETERS = (
    ("centre_of_mass", "centre_of_mass", "m", None, "centre of mass from O"),
    ("water_density", "water_density", "kg/m3", 0.0, "density of the water"),
)
_AIR_PARAMETERS = (
    ("air_drag", "air_drag", "kg/m", None, "force over squared air velocity"),
    ("air_centre", "air_centre", "m", None, "point at which the air drag acts, from O"),
    ("deck_centre", "deck_centre", "m", None, "centre of the top of the landing deck, from O"),
)


_Boat = TypeVar("_Boat", bound=Boat)

#: required keys of both families
KEYS = ("mass", "added_mass", "linear_damping", "propellers", "boxes", "crash_speed")
OPTIONAL_KEYS = (
    "centre_of_mass",
    "coriolis_added_mass",
    "air_drag",
    "air_centre",
    "deck_centre",
    "propeller",
    "rudders",
    "water_density",
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


class BoatReader(VehicleReader[_Boat]):
    """Reader of vessel data.

    Attributes:
        velocities: Names of the elements of nu.
    """

    velocities: Sequence[str]

    def read_boat(self, data: JsonObject, boxes: Sequence[Collision]) -> dict[str, Any]:
        """Read the attributes of `Boat` without its name, and the collision shape."""
        ones = [1.0] * len(self.velocities)
        added = self.read_nu_matrix(data, "added_mass", ones)
        centre = self.read_vector(data, "centre_of_mass")
        x, y = self.vector_quantity(data.get("air_drag", [0.0, 0.0]), ("air_drag",), "kg/m", "xy")
        if min(x, y) < 0:
            self.add_problem(("air_drag",), f"found {[x, y]}, expected numbers of at least 0")
        coriolis = added
        if "coriolis_added_mass" in data:
            coriolis = self.read_nu_matrix(data, "coriolis_added_mass", ones)
        return {
            "boxes": boxes,
            "mass": self.entry(data, "mass", "kg", above=0.0),
            "centre_of_mass": centre,
            "added_mass": added,
            "coriolis_added_mass": coriolis,
            "linear_damping": self.read_nu_matrix(data, "linear_damping", ones),
            "air_drag": (x, y),
            "air_centre": self.read_vector(data, "air_centre", default=centre),
            "deck_centre": self.read_vector(data, "deck_centre", default=_highest_top(boxes)),
            "propellers": self.read_propellers(data),
            "rudders": self.read_rudders(data),
            "water_density": self.entry(data, "water_density", "kg/m3", 1025.0, above=0.0),
        }

    def read_nu_matrix(
        self, data: JsonObject, key: str, default: Any, path: JsonPath = ()
    ) -> np.ndarray:
        """Read a matrix that belongs to nu: its diagonal or its rows."""
        return self.read_matrix(data.get(key, default), (*path, key), self.velocities)

    def read_propellers(self, data: JsonObject) -> list[Propeller]:
        """Read all propellers; what they have in common is in "propeller"."""
        common = self.read_data(
            data.get("propeller", {}), ("propeller",), (), tuple(_PROPELLER_QUANTITIES)
        )
        return [
            self.read_propeller(common, each, path)
            for path, each in self.elements(data, "propellers")
        ]

    def read_propeller(self, common: JsonObject, value: Any, path: JsonPath) -> Propeller:
        """Read one propeller; its quantities replace those of all propellers."""
        data = self.read_data(value, path, ("position",), ("label", "axis", *_PROPELLER_QUANTITIES))
        numbers: dict[str, float] = {}
        for key, unit in _PROPELLER_QUANTITIES.items():
            source, place = self.source_of(key, data, path, common, "propeller")
            default, limit = 0.0, {"low": 0.0}
            if key in _REQUIRED_OF_PROPELLERS and key in source:
                limit = {"above": 0.0}
            elif key in _REQUIRED_OF_PROPELLERS:
                self.add_missing(path, key, "propeller")
            elif key in _PROPELLER_DEFAULTS:
                default = numbers[_PROPELLER_DEFAULTS[key]]
            numbers[key] = self.entry(source, key, unit, default, place, **limit)
            if key == "time_constant" and 0 < numbers[key] < MIN_TIME_CONSTANT:
                expected = f"expected 0 (no lag) or at least {MIN_TIME_CONSTANT}"
                self.add_problem((*place, key), f"found {numbers[key]}, {expected}")
        position = self.read_vector(data, "position", path=path)
        label = self.read_label(data, path, "propeller")
        axis = self.read_axis(data.get("axis", [1.0, 0.0, 0.0]), (*path, "axis"))
        return Propeller(label, position, axis, **numbers)

    def read_rudders(self, data: JsonObject) -> list[Rudder]:
        """Read all rudders; a vessel may have none."""
        given = self.elements(data, "rudders") if data.get("rudders") != [] else []
        return [self.read_rudder(each, path) for path, each in given]

    def read_rudder(self, value: Any, path: JsonPath) -> Rudder:
        """Read one rudder."""
        data = self.read_data(value, path, _RUDDER_KEYS, _RUDDER_OPTIONAL_KEYS)
        right = math.pi / 2
        position = self.read_vector(data, "position", path=path)
        stall, largest = math.radians(30), math.radians(35)
        return Rudder(
            self.read_label(data, path, "rudder"),
            position,
            self.entry(data, "area", "m2", path=path, above=0.0),
            self.entry(data, "max_lift_coefficient", "1", 1.2, path, above=0.0),
            self.entry(data, "stall_angle", "rad", stall, path, low=0.01, high=right),
            self.entry(data, "max_angle", "rad", largest, path, low=0.0, high=right),
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
