"""Reader of the data of a multirotor: JSON to airframe and collision boxes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.errors import InputError

from ...json_reader import JsonPath
from ..common.shapes import BODY_UP, Body, Shape
from ..common.vehicle_reader import Collision, VehicleReader, boxes_in, edges_around
from .airframe import Airframe, Hull, Rotor, RotorEffects

#: sense of rotation seen from the tip of the thrust's axis -> sign of the reaction torque about
#: this axis
TORQUE_SIGNS = {"clockwise": 1.0, "counter-clockwise": -1.0}

#: required keys of the file
KEYS = ("mass", "inertia", "rotor", "rotors", "boxes", "crash_speed")
_OPTIONAL_KEYS = (
    "body_drag",
    "ground_effect",
    "gravity",
    "displaced_volume",
    "water_drag_coefficient",
)
_COEFFICIENTS = {"thrust_coefficient": "N.s2/rad2", "torque_coefficient": "N.m.s2/rad2"}
#: required and optional keys of all rotors
ROTOR_KEYS, _ROTOR_OPTIONAL_KEYS = (
    ("radius", "max_speed"),
    (*_COEFFICIENTS, "time_constant", "inertia", "drag", "translational_lift"),
)

#: density (kg/m3) of a vehicle whose file does not say what volume it displaces; it sinks
DEFAULT_DENSITY = 1200.0


@dataclass(frozen=True)
class MultirotorData:
    """Data of a multirotor: airframe, collision boxes and crash speed (m/s)."""

    airframe: Airframe
    boxes: tuple[Collision, ...]
    crash_speed: float

    def body_with(self, mass: float, inertia: np.ndarray) -> Body:
        """Return the rigid body for Bullet with another mass (kg) and inertia tensor (kg m2).

        Raises InputError.
        """
        return replace(self.airframe, mass=mass, inertia=inertia).body(self.boxes_in)

    def boxes_in(self, to_body: np.ndarray) -> tuple[Shape, ...]:
        """Return the boxes in the frame from which `to_body` (3, 3) rotates into the body frame."""
        return boxes_in(self.boxes, to_body)


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


class _MultirotorReader(VehicleReader):
    def read_multirotor(self, name: str, data: Any, keys: tuple[str, ...]) -> MultirotorData | None:
        """Read all data; None if the airframe is impossible."""
        data = self.read_data(data, (), KEYS, (*_OPTIONAL_KEYS, *keys))
        common = self.read_data(data.get("rotor"), ("rotor",), ROTOR_KEYS, _ROTOR_OPTIONAL_KEYS)
        values: dict[str, Any] = {
            "mass": self.quantity(data.get("mass", 1.0), ("mass",), "kg", above=0.0),
            "inertia": self.read_inertia(data.get("inertia", [1.0] * 3)),
            "rotors": [
                self.read_rotor(common, rotor, ("rotors", str(i)))
                for i, rotor in self.elements(data, "rotors")
            ],
            "max_rotor_speed": self.quantity(
                common.get("max_speed", 1.0), ("rotor", "max_speed"), "rad/s", above=0.0
            ),
            "rotor_radius": self.quantity(
                common.get("radius", 1.0), ("rotor", "radius"), "m", above=0.0
            ),
            "gravity": self.quantity(data.get("gravity", 9.81), ("gravity",), "m/s2", above=0.0),
            "effects": self.read_effects(data, common),
        }
        boxes = self.read_boxes(data)
        values["hull"] = self.read_hull(data, boxes, values["mass"])
        crash_speed = self.quantity(
            data.get("crash_speed", 1.0), ("crash_speed",), "m/s", above=0.0
        )
        if self.problems:
            return None
        airframe = self.construct(lambda: Airframe(name, **values))
        if airframe is None:
            return None
        self.check_lift(airframe)
        return MultirotorData(airframe, boxes, crash_speed)

    def check_lift(self, airframe: Airframe) -> None:
        """Report a multirotor that cannot fly.

        The thrust of all rotors at full speed along z is less than its weight.
        """
        weight = airframe.mass * airframe.gravity
        if airframe.lift < weight:
            path = ("rotors", "0", "axis") if airframe.lift < 0 else ("mass",)
            hint = ": is the mass in g?" if 0 < airframe.lift < weight / 100 else ""
            thrust = f"the thrust of all rotors at full speed is {airframe.lift:.4g} N along z"
            self.add_problem(path, f"it cannot fly: {thrust}, its weight {weight:.4g} N{hint}")

    def read_hull(self, data: Mapping[str, Any], boxes: Sequence[Collision], mass: float) -> Hull:
        """Read what water acts on.

        The box around all boxes, the displaced volume and the drag coefficient.
        """
        length, width, height = edges_around(boxes)
        volume = self.quantity(
            data.get("displaced_volume", mass / DEFAULT_DENSITY),
            ("displaced_volume",),
            "m3",
            low=0.0,
        )
        drag = data.get("water_drag_coefficient", 1.0)
        return Hull(
            (length, width, height),
            volume,
            self.quantity(drag, ("water_drag_coefficient",), "1", low=0.0),
        )

    def read_rotor(self, common: Mapping[str, Any], value: Any, path: JsonPath) -> Rotor:
        """Read one rotor; its coefficients replace those of all rotors."""
        data = self.read_data(value, path, ("position", "turns"), ("label", "axis", *_COEFFICIENTS))
        coefficients = {}
        for key, unit in _COEFFICIENTS.items():
            place, source = ((*path, key), data) if key in data else (("rotor", key), common)
            if key not in source:
                self.add_missing(path, key, "rotor")
            coefficients[key] = self.quantity(source.get(key, 1.0), place, unit, low=0.0)
        x, y, z = self.vector_quantity(
            data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz"
        )
        turns = self.choice(data.get("turns", "clockwise"), (*path, "turns"), tuple(TORQUE_SIGNS))
        label = self.text(data.get("label", f"rotor {int(path[-1]) + 1}"), (*path, "label"))
        axis = self.read_axis(data["axis"], (*path, "axis")) if "axis" in data else BODY_UP
        return Rotor(label, (x, y, z), TORQUE_SIGNS[turns], axis=axis, **coefficients)

    def read_effects(self, data: Mapping[str, Any], common: Mapping[str, Any]) -> RotorEffects:
        """Read the effects beyond thrust and torque; those that are missing are off."""
        zero = [0.0] * 3
        rotor_drag = self.vector_quantity(
            common.get("drag", zero), ("rotor", "drag"), "kg/rad", "xyz"
        )
        body_drag = self.vector_quantity(data.get("body_drag", zero), ("body_drag",), "kg/m", "xyz")
        for path, drag in ((("rotor", "drag"), rotor_drag), (("body_drag",), body_drag)):
            if min(drag) < 0:
                self.add_problem(path, f"found {list(drag)}, expected numbers of at least 0")
        return RotorEffects(
            self.quantity(
                common.get("time_constant", 0.0), ("rotor", "time_constant"), "s", low=0.0
            ),
            self.quantity(common.get("inertia", 0.0), ("rotor", "inertia"), "kg.m2", low=0.0),
            (rotor_drag[0], rotor_drag[1], rotor_drag[2]),
            (body_drag[0], body_drag[1], body_drag[2]),
            self.quantity(data.get("ground_effect", 0.0), ("ground_effect",), "1", 0.0, 1.0),
            self.quantity(
                common.get("translational_lift", 0.0),
                ("rotor", "translational_lift"),
                "kg/m",
                low=0.0,
            ),
        )
