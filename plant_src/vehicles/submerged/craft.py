"""Submerged family: a rigid body in water with thrusters, the reader of its data, its variables.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units. Matrices (6, 6) belong
to (u, v, w, p, q, r).

The arrays of the thrusters have as many elements as the vehicle has thrusters, or more: the
equations of all submerged vehicles in a world are compiled once, for MAX_THRUSTERS thrusters.
Elements without a thruster are 0.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import Problem
from cosim.core.json_values import JsonObject

from ...json_reader import JsonPath
from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WORLD_OUTPUTS,
    attribute_parameters,
    element_commands,
    element_labels,
    element_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    matrix_parameter,
)
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

    def read_values(self, data: JsonObject) -> dict[str, Any]:
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

    def read_volume(self, data: JsonObject, boxes: tuple[Collision, ...]) -> dict[str, Any]:
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

    def read_thruster(self, common: JsonObject, value: Any, path: JsonPath) -> Thruster:
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


#: number of parts of the displaced volume
OCTANTS = 8


def variables(craft: Craft, thruster_slots: int | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs, in the order of the equations.

    Parameters other than `initial.*` start at the values of the craft.

    Args:
        craft: Data of the vehicle.
        thruster_slots: Number of elements of the arrays of the thrusters. None means the number of
            thrusters.
    """
    slots = len(craft.thrusters) if thruster_slots is None else thruster_slots
    labels = element_labels([thruster.label for thruster in craft.thrusters], slots, str(slots))
    limit = f"{craft.max_thruster_speed:.4g}"
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        *inertia_variables(craft.mass, craft.inertia, "total mass with the enclosed water"),
        *attribute_parameters(craft, _WATER_PARAMETERS),
        *(
            matrix_parameter(name, f"{text}, for u, v, w, p, q, r", getattr(craft, name))
            for name, text in MATRICES.items()
        ),
        *element_parameters("thruster", craft.thrusters, _THRUSTER_COLUMNS, slots),
        *attribute_parameters(craft, _THRUSTER_PARAMETERS),
        *EXTERNAL_LOADS,
        element_commands(
            "thruster_speed",
            "rad/s",
            f"commanded thruster speeds ({labels}), limited to -{limit} ... {limit} rad/s",
            slots,
        ),
        *CURRENT_INPUTS,
        replace(WATER_LEVEL_INPUT[0], start=0.0),
        *MOTION_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def states(thruster_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of the rigid body, then the thruster speeds."""
    return (*FREE_STATES, *element_states("thruster_speed", thruster_slots))


#: attribute, and name, unit, smallest value and description of its parameter
_WATER_PARAMETERS = (
    ("gravity", "gravity", "m/s2", 0.0, "gravitational acceleration"),
    ("water_density", "water_density", "kg/m3", 0.0, "density of the water"),
    (
        "displaced_volume",
        "displaced_volume",
        "m3",
        0.0,
        "volume of water that the submerged vehicle displaces",
    ),
    ("centre_of_buoyancy", "centre_of_buoyancy", "m", None, "centre of this volume"),
    ("size", "hull_size", "m", 0.0, "edge of the box of this volume"),
)
_THRUSTER_PARAMETERS = (
    (
        "max_thruster_speed",
        "max_thruster_speed",
        "rad/s",
        0.0,
        "largest magnitude of the speeds",
    ),
    ("thruster_radius", "thruster_radius", "m", 0.0, "radius of the propellers"),
    (
        "thruster_time_constant",
        "thruster_time_constant",
        "s",
        0.0,
        "time constant of the thruster speeds; 0: no lag",
    ),
    (
        "advance_coefficient",
        "advance_coefficient",
        "kg/rad",
        0.0,
        "loss of thrust over speed and axial velocity of the water",
    ),
)

#: attribute of a thruster, and name, unit and description of its array
_THRUSTER_COLUMNS = (
    ("position", "thruster_position", "m", "centres of the propellers"),
    ("axis", "thruster_axis", "1", "unit vectors of the thrusts"),
    (
        "thrust_coefficient",
        "thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at positive speeds",
    ),
    (
        "reverse_thrust_coefficient",
        "reverse_thrust_coefficient",
        "N.s2/rad2",
        "thrust over squared speed at negative speeds",
    ),
    (
        "torque_coefficient",
        "torque_coefficient",
        "N.m.s2/rad2",
        "reaction torque on the body about the axis over squared speed",
    ),
)
