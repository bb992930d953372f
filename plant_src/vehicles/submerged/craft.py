"""Data of a submerged vehicle, a rigid body in water with thrusters, and their reader.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units. Matrices (6, 6) belong
to (u, v, w, p, q, r).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.core.errors import Problem

from ...json_reader import JsonPath
from ..common.shapes import Vector, eigenvalue_problems, symmetry_problems
from ..common.vehicle_reader import (
    TORQUE_SIGNS,
    Collision,
    FreeVehicle,
    VehicleReader,
    edges_around,
)

#: largest number of thrusters
MAX_THRUSTERS = 16

#: parameter -> description of its matrix (6, 6)
MATRICES = {
    "added_mass": "added mass about the centre of mass",
    "linear_damping": "load over velocity relative to the water",
    "quadratic_damping": "load over squared velocity relative to the water",
}


@dataclass(frozen=True)
class Thruster:
    """One thruster.

    Attributes:
        label: Place of the thruster in words.
        position: Centre of the propeller from the centre of mass (m, body frame).
        axis: Unit vector of the thrust at a positive speed (body frame).
        thrust_coefficient: Thrust over squared speed at positive speeds (N s2/rad2).
        reverse_thrust_coefficient: The same at negative speeds.
        torque_coefficient: Reaction torque on the body about the axis over squared speed (N m
            s2/rad2), with its sign at positive speeds.
    """

    label: str
    position: Vector
    axis: Vector
    thrust_coefficient: float
    reverse_thrust_coefficient: float
    torque_coefficient: float = 0.0


@dataclass(frozen=True)
class Craft(FreeVehicle):
    """A rigid body in water with thrusters; its mass contains the water in free-flooding spaces.

    Attributes:
        displaced_volume: Volume of water that the submerged vehicle displaces (m3).
        centre_of_buoyancy: Centre of this volume (m, body frame).
        size: Edges of the box over which this volume is distributed (m); it matters at the surface
            only.
        added_mass: Added mass about the centre of mass, shape (6, 6).
        linear_damping: Matrix D_l of the load -D_l nu_r, shape (6, 6).
        quadratic_damping: Matrix D_q of the load -D_q (|nu_r| nu_r), products by elements, shape
            (6, 6).
        thrusters: All thrusters, at most MAX_THRUSTERS.
        max_thruster_speed: Largest magnitude of the thruster speeds (rad/s).
        thruster_radius: Radius of the propellers (m).
        thruster_time_constant: Time constant of the thruster speeds (s); 0: no lag.
        advance_coefficient: Loss of thrust over speed and axial velocity of the water (kg/rad).
        gravity: Gravitational acceleration (m/s2).
        water_density: Density of the water (kg/m3).
    """

    kind = "submerged vehicle"
    displaced_volume: float
    centre_of_buoyancy: Vector
    size: Vector
    added_mass: np.ndarray
    linear_damping: np.ndarray
    quadratic_damping: np.ndarray
    thrusters: Sequence[Thruster]
    max_thruster_speed: float
    thruster_radius: float
    thruster_time_constant: float = 0.0
    advance_coefficient: float = 0.0
    gravity: float = 9.81
    water_density: float = 1025.0

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from super().problems()
        yield from self.inertia_problems()
        for text in symmetry_problems(self.added_mass):
            yield self.problem(text, "added_mass")
        for name in ("added_mass", "linear_damping"):
            for text in eigenvalue_problems(getattr(self, name)):
                yield self.problem(f"{text}: energy is not generated", name)
        if (np.diag(self.quadratic_damping) < 0).any():
            diagonal = np.diag(self.quadratic_damping).tolist()
            text = f"found the diagonal {diagonal}, expected numbers of at least 0"
            yield self.problem(text, "quadratic_damping")
        if not 1 <= (count := len(self.thrusters)) <= MAX_THRUSTERS:
            yield self.problem(
                f"found {count or 'none'}, expected 1 to {MAX_THRUSTERS}", "thrusters"
            )


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


class SubmergedReader(VehicleReader[Craft]):
    """Reader of the data of a submerged vehicle (`plant_src/vehicles/data/README.md`)."""

    keys, optional_keys, vehicle_class = KEYS, _OPTIONAL_KEYS, Craft

    def read_values(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Read the attributes of the craft, and the collision shape."""
        path = ("thruster",)
        common = self.read_data(data.get("thruster"), path, THRUSTER_KEYS, _THRUSTER_OPTIONAL_KEYS)
        boxes = self.read_boxes(data)
        return {
            "boxes": boxes,
            **self.read_volume(data, boxes),
            "max_thruster_speed": self.entry(common, "max_speed", "rad/s", path=path, above=0.0),
            "thruster_radius": self.entry(common, "radius", "m", path=path, above=0.0),
            "thruster_time_constant": self.entry(common, "time_constant", "s", 0.0, path, low=0.0),
            "advance_coefficient": self.entry(
                common, "advance_coefficient", "kg/rad", 0.0, path, low=0.0
            ),
            **{
                matrix: self.read_matrix(data.get(matrix, [1.0] * 6), (matrix,), "uvwpqr")
                for matrix in MATRICES
            },
            "mass": self.entry(data, "mass", "kg", above=0.0),
            "inertia": self.read_inertia(data),
            "thrusters": [
                self.read_thruster(common, each, place)
                for place, each in self.elements(data, "thrusters")
            ],
        }

    def read_volume(self, data: Mapping[str, Any], boxes: tuple[Collision, ...]) -> dict[str, Any]:
        """Read what determines weight and buoyancy."""
        size = self.read_size(data, (), edges_around(boxes))
        volume = self.entry(data, "displaced_volume", "m3", above=0.0)
        if not self.problems and volume > (box := math.prod(size)):
            text = (
                f"found {volume:g}, expected at most {box:.4g}, the volume of the box with the "
                f"edges {list(size)} m"
            )
            self.add_problem(("displaced_volume",), text)
        return {
            "displaced_volume": volume,
            "centre_of_buoyancy": self.read_vector(data, "centre_of_buoyancy"),
            "size": size,
            "gravity": self.entry(data, "gravity", "m/s2", 9.81, above=0.0),
            "water_density": self.entry(data, "water_density", "kg/m3", 1025.0, above=0.0),
        }

    def read_thruster(self, common: Mapping[str, Any], value: Any, path: JsonPath) -> Thruster:
        """Read one thruster; its coefficients replace those of all thrusters."""
        data = self.read_data(value, path, ("position", "axis"), ("label", "turns", *_COEFFICIENTS))
        if "thrust_coefficient" not in {*data, *common}:
            self.add_missing(path, "thrust_coefficient", "thruster")
        coefficients: dict[str, float] = {}
        for key, unit in _COEFFICIENTS.items():
            source, place = self.source_of(key, data, path, common, "thruster")
            default = coefficients.get("thrust_coefficient", 1.0) if "thrust" in key else 0.0
            coefficients[key] = self.entry(source, key, unit, default, place, low=0.0)
        turns = self.choice(data.get("turns", "clockwise"), (*path, "turns"), tuple(TORQUE_SIGNS))
        if coefficients["torque_coefficient"] and "turns" not in data:
            text = (
                '"turns" is missing; a thruster with a torque_coefficient has a sense of rotation'
            )
            self.add_problem(path, text)
        coefficients["torque_coefficient"] *= TORQUE_SIGNS[turns]
        position = self.read_vector(data, "position", path=path)
        label = self.read_label(data, path, "thruster")
        axis = self.read_axis(data.get("axis", [1.0, 0.0, 0.0]), (*path, "axis"))
        return Thruster(label, position, axis, **coefficients)
