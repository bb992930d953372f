"""Data of a multirotor, a rigid body with rotors, and their reader.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cosim.core.errors import Problem

from ...json_reader import JsonPath
from ..common.shapes import BODY_UP, Vector
from ..common.vehicle_reader import (
    TORQUE_SIGNS,
    Collision,
    FreeVehicle,
    VehicleReader,
    edges_around,
)

#: largest number of rotors
MAX_ROTORS = 16


@dataclass(frozen=True)
class Rotor:
    """One rotor.

    Attributes:
        label: Place of the rotor in words, for example "front left".
        position: Hub from the centre of mass (m, body frame).
        torque_sign: Sign (+1 or -1) of the reaction torque on the body about `axis`.
        thrust_coefficient: Thrust over squared speed (N s2/rad2).
        torque_coefficient: Reaction torque over squared speed (N m s2/rad2).
        axis: Unit vector of the thrust (body frame), which is also the axis of rotation.
    """

    label: str
    position: Vector
    torque_sign: float
    thrust_coefficient: float
    torque_coefficient: float
    axis: Vector = BODY_UP

    @property
    def signed_torque_coefficient(self) -> float:
        """Reaction torque about the axis over squared speed, with its sign (N m s2/rad2)."""
        return self.torque_sign * self.torque_coefficient


@dataclass(frozen=True)
class RotorEffects:
    """Start values of the parameters of all effects beyond thrust and torque.

    Zero switches an effect off.

    Attributes:
        rotor_time_constant: Time constant of the first-order lag of the rotor speeds (s).
        rotor_inertia: Moment of inertia of a rotor with its motor about its axis (kg m2).
        rotor_drag: Force per rotor speed and air speed along x, y and z (kg/rad, body frame).
        body_drag: Force per squared air speed along x, y and z (kg/m, body frame).
        ground_effect: Fraction of the ground effect's thrust that is applied (0 to 1).
        translational_lift: Thrust of a rotor over the square of the air speed in its plane (kg/m).
    """

    rotor_time_constant: float = 0.0
    rotor_inertia: float = 0.0
    rotor_drag: Vector = (0.0, 0.0, 0.0)
    body_drag: Vector = (0.0, 0.0, 0.0)
    ground_effect: float = 0.0
    translational_lift: float = 0.0


@dataclass(frozen=True)
class Hull:
    """The body in water; a hull without volume and size is not affected by water.

    Attributes:
        size: Edges of the box around the body (m, body frame).
        volume: Volume of water that the submerged vehicle displaces (m3).
        drag_coefficient: Drag coefficient of the box (1).
    """

    size: Vector = (0.0, 0.0, 0.0)
    volume: float = 0.0
    drag_coefficient: float = 1.0


@dataclass(frozen=True)
class Airframe(FreeVehicle):
    """A rigid body with rotors.

    Attributes:
        rotors: All rotors, at most MAX_ROTORS.
        max_rotor_speed: Upper limit of the rotor speeds (rad/s); the lower limit is 0.
        rotor_radius: Radius of a rotor (m).
        effects: Start values of the further effects.
        gravity: Gravitational acceleration (m/s2).
        hull: The body in water.
    """

    kind = "airframe"
    rotors: Sequence[Rotor]
    max_rotor_speed: float
    rotor_radius: float
    effects: RotorEffects = field(default_factory=RotorEffects)
    gravity: float = 9.81
    hull: Hull = field(default_factory=Hull)

    @property
    def rotor_disc(self) -> tuple[Vector, float]:
        """Mean position of the rotors (m, body frame), and radius (m) of the disc around them."""
        hubs = np.array([rotor.position for rotor in self.rotors])
        x, y, z = hubs.mean(axis=0).tolist()
        return (x, y, z), float(np.hypot(hubs[:, 0] - x, hubs[:, 1] - y).max()) + self.rotor_radius

    @property
    def lift(self) -> float:
        """Sum of the thrusts of all rotors at full speed along z (N, body frame)."""
        return self.max_rotor_speed**2 * sum(
            rotor.thrust_coefficient * rotor.axis[2] for rotor in self.rotors
        )

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from self.size_problems("mass", "max_rotor_speed", "rotor_radius", "gravity")
        for part in ("effects", "hull"):
            for name, value in vars(getattr(self, part)).items():
                if not all(0 <= number < math.inf for number in np.ravel(value)):
                    text = f"found {value!r}, expected finite numbers of at least 0"
                    yield self.problem(text, part, name)
        yield from self.inertia_problems()
        if not 1 <= len(self.rotors) <= MAX_ROTORS:
            yield self.problem(
                f"found {len(self.rotors) or 'none'}, expected 1 to {MAX_ROTORS}", "rotors"
            )
        for number, rotor in enumerate(self.rotors, 1):
            name = f"rotors[{number}]"
            for coefficient in ("thrust_coefficient", "torque_coefficient"):
                if not 0 <= (value := getattr(rotor, coefficient)) < math.inf:
                    text = f"found {value!r}, expected a finite number of at least 0"
                    yield self.problem(text, name, coefficient)
            if rotor.torque_sign not in (1, -1):
                text = f"found {rotor.torque_sign!r}, expected 1 or -1"
                yield self.problem(text, name, "torque_sign")
            if not math.isclose(math.hypot(*rotor.axis), 1, rel_tol=1e-9):
                yield self.problem(f"found {rotor.axis}, expected a unit vector", name, "axis")
            if not all(map(math.isfinite, rotor.position)):
                text = f"found {rotor.position}, expected finite numbers"
                yield self.problem(text, name, "position")


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
ROTOR_KEYS = ("radius", "max_speed")
_ROTOR_OPTIONAL_KEYS = (*_COEFFICIENTS, "time_constant", "inertia", "drag", "translational_lift")

#: density (kg/m3) of a vehicle whose file does not say what volume it displaces; it sinks
DEFAULT_DENSITY = 1200.0


class MultirotorReader(VehicleReader[Airframe]):
    """Reader of the data of a multirotor (`plant_src/vehicles/README.md`)."""

    keys, optional_keys, vehicle_class = KEYS, _OPTIONAL_KEYS, Airframe

    def read_values(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Read the attributes of the airframe, and the collision shape."""
        common = self.read_data(data.get("rotor"), ("rotor",), ROTOR_KEYS, _ROTOR_OPTIONAL_KEYS)
        path = ("rotor",)
        values: dict[str, Any] = {
            "mass": self.entry(data, "mass", "kg", above=0.0),
            "inertia": self.read_inertia(data),
            "rotors": [
                self.read_rotor(common, rotor, place)
                for place, rotor in self.elements(data, "rotors")
            ],
            "max_rotor_speed": self.entry(common, "max_speed", "rad/s", path=path, above=0.0),
            "rotor_radius": self.entry(common, "radius", "m", path=path, above=0.0),
            "gravity": self.entry(data, "gravity", "m/s2", 9.81, above=0.0),
            "effects": self.read_effects(data, common),
            "boxes": self.read_boxes(data),
        }
        values["hull"] = self.read_hull(data, values["boxes"], values["mass"])
        return values

    def check(self, vehicle: Airframe) -> None:
        """Report a multirotor that cannot fly.

        The thrust of all rotors at full speed along z is less than its weight.
        """
        lift, weight = vehicle.lift, vehicle.mass * vehicle.gravity
        if lift < weight:
            path = ("rotors", "0", "axis") if lift < 0 else ("mass",)
            hint = ": is the mass in g?" if 0 < lift < weight / 100 else ""
            thrust = f"the thrust of all rotors at full speed is {lift:.4g} N along z"
            self.add_problem(path, f"it cannot fly: {thrust}, its weight {weight:.4g} N{hint}")

    def read_hull(self, data: Mapping[str, Any], boxes: Sequence[Collision], mass: float) -> Hull:
        """Read what water acts on.

        The box around all boxes, the displaced volume and the drag coefficient.
        """
        volume = self.entry(data, "displaced_volume", "m3", mass / DEFAULT_DENSITY, low=0.0)
        drag = self.entry(data, "water_drag_coefficient", "1", 1.0, low=0.0)
        return Hull(edges_around(boxes), volume, drag)

    def read_rotor(self, common: Mapping[str, Any], value: Any, path: JsonPath) -> Rotor:
        """Read one rotor; its coefficients replace those of all rotors."""
        data = self.read_data(value, path, ("position", "turns"), ("label", "axis", *_COEFFICIENTS))
        coefficients = {}
        for key, unit in _COEFFICIENTS.items():
            source, place = self.source_of(key, data, path, common, "rotor")
            if key not in source:
                self.add_missing(path, key, "rotor")
            coefficients[key] = self.entry(source, key, unit, path=place, low=0.0)
        position = self.read_vector(data, "position", path=path)
        turns = self.choice(data.get("turns", "clockwise"), (*path, "turns"), tuple(TORQUE_SIGNS))
        label = self.read_label(data, path, "rotor")
        axis = self.read_axis(data["axis"], (*path, "axis")) if "axis" in data else BODY_UP
        return Rotor(label, position, TORQUE_SIGNS[turns], axis=axis, **coefficients)

    def read_effects(self, data: Mapping[str, Any], common: Mapping[str, Any]) -> RotorEffects:
        """Read the effects beyond thrust and torque; those that are missing are off."""
        path = ("rotor",)

        def of_rotor(key: str, unit: str) -> float:
            return self.entry(common, key, unit, 0.0, path, low=0.0)

        return RotorEffects(
            rotor_drag=self.read_vector(common, "drag", "kg/rad", path=path, minimum=0.0),
            body_drag=self.read_vector(data, "body_drag", "kg/m", minimum=0.0),
            rotor_time_constant=of_rotor("time_constant", "s"),
            rotor_inertia=of_rotor("inertia", "kg.m2"),
            ground_effect=self.entry(data, "ground_effect", "1", 0.0, low=0.0, high=1.0),
            translational_lift=of_rotor("translational_lift", "kg/m"),
        )
