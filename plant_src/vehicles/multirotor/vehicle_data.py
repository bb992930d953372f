"""Reader of the data of a multirotor: JSON to airframe and collision boxes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from cosim.core.errors import InputError

from ...json_reader import JsonPath
from ..common.quantities import QuantityReader
from ..common.shapes import Body, Box, Vector, level_box
from .airframe import BODY_UP, Airframe, Hull, Rotor, RotorEffects

#: sense of rotation seen from the tip of the thrust's axis -> sign of the reaction torque about this axis
TORQUE_SIGNS = {"clockwise": 1.0, "counter-clockwise": -1.0}

_KEYS = ("mass", "inertia", "rotor", "rotors", "boxes", "crash_speed")
_OPTIONAL_KEYS = ("body_drag", "ground_effect", "gravity", "displaced_volume", "water_drag_coefficient")
_COEFFICIENTS = {"thrust_coefficient": "N.s2/rad2", "torque_coefficient": "N.m.s2/rad2"}
_ROTOR_KEYS, _ROTOR_OPTIONAL_KEYS = (
    ("radius", "max_speed"),
    (*_COEFFICIENTS, "time_constant", "inertia", "drag", "translational_lift"),
)

#: density (kg/m3) of a vehicle whose file does not say what volume it displaces; it sinks
DEFAULT_DENSITY = 1200.0


@dataclass(frozen=True)
class CollisionBox:
    """A box of the collision shape in the body frame: edges and centre (m), and its angle about the z axis (rad)."""

    size: Vector
    position: Vector
    yaw: float

    def corners(self) -> np.ndarray:
        """Return the corners (m, body frame), shape (8, 3)."""
        x, y, z = (np.array(list(product((-0.5, 0.5), repeat=3))) * self.size).T
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return np.column_stack([cosine * x - sine * y, sine * x + cosine * y, z]) + self.position


@dataclass(frozen=True)
class MultirotorData:
    """Data of a multirotor: airframe, collision boxes and crash speed (m/s)."""

    airframe: Airframe
    boxes: tuple[CollisionBox, ...]
    crash_speed: float

    def body(self) -> Body:
        """Return the rigid body for Bullet, in the principal axes."""
        return self.airframe.body(self.boxes_in)

    def boxes_in(self, to_body: np.ndarray) -> tuple[Box, ...]:
        """Return the boxes in the frame from which `to_body` (3, 3) rotates into the body frame."""
        return tuple(level_box(to_body, box.size, box.position, box.yaw) for box in self.boxes)


def read_multirotor(name: str, data: Mapping[str, Any], keys: tuple[str, ...]) -> MultirotorData:
    """Read the data of a multirotor.

    Args:
        name: Name of the vehicle.
        data: JSON object (`plant_src/vehicles/README.md`).
        keys: Keys that vehicles of all families have.

    Raises:
        InputError: With all problems; the subject of each is the path of the value.
    """
    reader = _MultirotorReader()
    vehicle = reader.read_multirotor(name, data, keys)
    if reader.problems or vehicle is None:
        raise InputError(reader.problems)
    return vehicle


class _MultirotorReader(QuantityReader):
    def read_multirotor(self, name: str, data: Any, keys: tuple[str, ...]) -> MultirotorData | None:
        """Read all data; None if the airframe is impossible."""
        data = self.read_data(data, (), _KEYS, (*_OPTIONAL_KEYS, *keys))
        common = self.read_data(data.get("rotor"), ("rotor",), _ROTOR_KEYS, _ROTOR_OPTIONAL_KEYS)
        values: dict[str, Any] = {
            "mass": self.quantity(data.get("mass", 1.0), ("mass",), "kg", above=0.0),
            "inertia": self.read_inertia(data.get("inertia", [1.0] * 3)),
            "rotors": [self.read_rotor(common, rotor, ("rotors", str(i))) for i, rotor in self.elements(data, "rotors")],
            "max_rotor_speed": self.quantity(common.get("max_speed", 1.0), ("rotor", "max_speed"), "rad/s", above=0.0),
            "rotor_radius": self.quantity(common.get("radius", 1.0), ("rotor", "radius"), "m", above=0.0),
            "gravity": self.quantity(data.get("gravity", 9.81), ("gravity",), "m/s2", above=0.0),
            "effects": self.read_effects(data, common),
        }
        boxes = tuple(self.read_box(box, ("boxes", str(i))) for i, box in self.elements(data, "boxes"))
        values["hull"] = self.read_hull(data, boxes, values["mass"])
        crash_speed = self.quantity(data.get("crash_speed", 1.0), ("crash_speed",), "m/s", above=0.0)
        if self.problems:
            return None
        try:
            return MultirotorData(Airframe(name, **values), boxes, crash_speed)
        except InputError as error:
            for problem in error.problems:
                self.add_problem(problem.subject, problem.message)
            return None

    def read_hull(self, data: Mapping[str, Any], boxes: Sequence[CollisionBox], mass: float) -> Hull:
        """Read what water acts on: the box around all boxes, the displaced volume and the drag coefficient."""
        corners = np.concatenate([box.corners() for box in boxes or (CollisionBox((1.0,) * 3, (0.0,) * 3, 0.0),)])
        length, width, height = np.ptp(corners, axis=0).tolist()
        volume = self.quantity(data.get("displaced_volume", mass / DEFAULT_DENSITY), ("displaced_volume",), "m3", low=0.0)
        drag = data.get("water_drag_coefficient", 1.0)
        return Hull((length, width, height), volume, self.quantity(drag, ("water_drag_coefficient",), "1", low=0.0))

    def elements(self, data: Mapping[str, Any], key: str) -> list[tuple[int, Any]]:
        """Read a list with at least one element; return its elements with their indices."""
        value = data.get(key, [{}])
        if not isinstance(value, list) or not value:
            self.add_problem((key,), f"found {value!r}, expected a list with at least one element")
            return []
        return list(enumerate(value)) if key in data else []

    def read_inertia(self, value: Any) -> np.ndarray:
        """Read three moments of inertia, or three rows of a tensor."""
        numbers = self.si_value(value, ("inertia",), "kg.m2")
        rows = isinstance(numbers, list) and len(numbers) == 3 and all(isinstance(row, list) for row in numbers)
        if rows:
            return np.array([self.vector(row, ("inertia", str(i)), "xyz") for i, row in enumerate(numbers)])
        return np.diag(self.vector(numbers, ("inertia",), ("xx", "yy", "zz")))

    def read_rotor(self, common: Mapping[str, Any], value: Any, path: JsonPath) -> Rotor:
        """Read one rotor; its coefficients replace those of all rotors."""
        data = self.read_data(value, path, ("position", "turns"), ("label", "axis", *_COEFFICIENTS))
        coefficients = {}
        for key, unit in _COEFFICIENTS.items():
            place, source = ((*path, key), data) if key in data else (("rotor", key), common)
            if key not in source:
                self.add_problem(path, f'"{key}" is missing, here and in "rotor"')
            coefficients[key] = self.quantity(source.get(key, 1.0), place, unit, low=0.0)
        x, y, z = self.vector_quantity(data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz")
        turns = self.choice(data.get("turns", "clockwise"), (*path, "turns"), tuple(TORQUE_SIGNS))
        label = self.text(data.get("label", f"rotor {int(path[-1]) + 1}"), (*path, "label"))
        axis = self.read_axis(data["axis"], (*path, "axis")) if "axis" in data else BODY_UP
        return Rotor(label, (x, y, z), TORQUE_SIGNS[turns], axis=axis, **coefficients)

    def read_axis(self, value: Any, path: JsonPath) -> Vector:
        """Read the direction of a thrust and return it as a unit vector."""
        x, y, z = self.vector_quantity(value, path, "1", "xyz")
        length = math.hypot(x, y, z)
        if not length:
            self.add_problem(path, "found the zero vector, expected a direction")
            return BODY_UP
        return x / length, y / length, z / length

    def read_effects(self, data: Mapping[str, Any], common: Mapping[str, Any]) -> RotorEffects:
        """Read the effects beyond thrust and torque; those that are missing are off."""
        zero = [0.0] * 3
        rotor_drag = self.vector_quantity(common.get("drag", zero), ("rotor", "drag"), "kg/rad", "xyz")
        body_drag = self.vector_quantity(data.get("body_drag", zero), ("body_drag",), "kg/m", "xyz")
        return RotorEffects(
            self.quantity(common.get("time_constant", 0.0), ("rotor", "time_constant"), "s", low=0.0),
            self.quantity(common.get("inertia", 0.0), ("rotor", "inertia"), "kg.m2", low=0.0),
            (rotor_drag[0], rotor_drag[1], rotor_drag[2]),
            (body_drag[0], body_drag[1], body_drag[2]),
            self.quantity(data.get("ground_effect", 0.0), ("ground_effect",), "1", 0.0, 1.0),
            self.quantity(common.get("translational_lift", 0.0), ("rotor", "translational_lift"), "kg/m", low=0.0),
        )

    def read_box(self, value: Any, path: JsonPath) -> CollisionBox:
        """Read one box of the collision shape."""
        data = self.read_data(value, path, ("size",), ("position", "yaw"))
        length, width, height = self.vector_quantity(data.get("size", [1.0] * 3), (*path, "size"), "m", "xyz")
        if not min(length, width, height) > 0:
            self.add_problem((*path, "size"), f"found {[length, width, height]}, expected edges greater than 0")
        x, y, z = self.vector_quantity(data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz")
        return CollisionBox((length, width, height), (x, y, z), self.quantity(data.get("yaw", 0.0), (*path, "yaw"), "rad"))
