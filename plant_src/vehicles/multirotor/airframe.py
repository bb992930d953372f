"""Multirotor family: a rigid body with rotors, the reader of its data, and its variables.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units.

The arrays of the rotors have as many elements as the airframe has rotors, or more: the equations of
all multirotors in a world are compiled once, for MAX_ROTORS rotors. Elements without a rotor are 0.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import Problem
from cosim.core.json_values import JsonObject

from ...json_reader import JsonPath
from ...json_reader import argument_problem as warning
from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    FREE_STATES,
    GROUND_INPUTS,
    MOTION_OUTPUTS,
    WATER_LEVEL_INPUT,
    WIND_INPUTS,
    WORLD_OUTPUTS,
    attribute_parameters,
    element_commands,
    element_labels,
    element_parameters,
    element_states,
    inertia_variables,
    initial_variables,
    parameter,
    scalar_variable,
)
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

#: largest distance of a rotor from the centre of mass over the median of all rotors, and over the
#: farthest corner of the boxes
MAX_ROTOR_DISTANCE = 5.0
#: smallest and largest ratio of thrust to weight; the shipped multirotors have 1.7 to 3.2, racing
#: drones reach about 15
MIN_THRUST_RATIO, MAX_THRUST_RATIO = 1.3, 30.0
#: largest speed of the tips of rotors (m/s), the speed of sound
MAX_TIP_SPEED = 340.0
#: largest thrust coefficient, thrust over air density, disc area and squared tip speed; the shipped
#: rotors have about 0.01
MAX_THRUST_COEFFICIENT = 0.1
_AIR_DENSITY = 1.225
#: z component of the axis of a rotor that pushes downwards
_DOWNWARDS = -0.1


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

    def warnings(self, reach: float) -> Iterator[Problem]:
        """Yield what is probably wrong; the subject is "arguments" and the path in the file.

        Args:
            reach: Distance (m) of the farthest corner of the boxes from the centre of mass.
        """
        yield from self._thrust_warnings()
        yield from self._rotor_warnings(reach)

    def _thrust_warnings(self) -> Iterator[Problem]:
        ratio = self.lift / (self.mass * self.gravity)
        if ratio > MAX_THRUST_RATIO:
            text, *path = self._cause_of_thrust()
            yield warning(
                f"thrust over weight is {ratio:.3g}, expected less than {MAX_THRUST_RATIO:g}{text}",
                *path,
            )
        elif ratio < MIN_THRUST_RATIO:
            text = (
                f"thrust over weight is {ratio:.3g}, expected more than {MIN_THRUST_RATIO:g}: it "
                "can hardly climb"
            )
            yield warning(text, "mass")

    def _cause_of_thrust(self) -> tuple[str, ...]:
        """Return the probable cause of a thrust that is too large, and the path of its key."""
        tip_speed = self.max_rotor_speed * self.rotor_radius
        if tip_speed > MAX_TIP_SPEED:
            found = (
                f"{self.max_rotor_speed:.4g} rad/s make {tip_speed:.4g} m/s at the tips of the "
                "rotors"
            )
            return f"; {found}: is max_speed in rpm?", "rotor", "max_speed"
        area, thrust = (
            math.pi * self.rotor_radius**2,
            max(rotor.thrust_coefficient for rotor in self.rotors),
        )
        coefficient = thrust / (_AIR_DENSITY * area * self.rotor_radius**2)
        if coefficient > MAX_THRUST_COEFFICIENT:
            text = (
                f"; the thrust is {coefficient:.3g} times air density, disc area and squared tip "
                "speed, about 0.01 is usual"
            )
            return text, "rotor", "thrust_coefficient"
        return "", "mass"

    def _rotor_warnings(self, reach: float) -> Iterator[Problem]:
        distances = [float(np.linalg.norm(rotor.position)) for rotor in self.rotors]
        ordered, middle = sorted(distances), len(distances) // 2
        # not np.median, whose first call imports masked arrays for 0.04 s
        median = (ordered[middle] + ordered[-1 - middle]) / 2
        limit = MAX_ROTOR_DISTANCE * max(self.rotor_radius, min(median, 2 * reach))
        for i, (rotor, distance) in enumerate(zip(self.rotors, distances, strict=True)):
            if distance > limit:
                text = f"{distance:.4g} m from the centre of mass, expected less than {limit:.3g} m"
                yield warning(text, "rotors", str(i), "position")
            if rotor.axis[2] < _DOWNWARDS:
                axis = ", ".join(f"{round(each, 3):g}" for each in rotor.axis)
                yield warning(
                    f"the rotor pushes downwards, its thrust points along [{axis}]",
                    "rotors",
                    str(i),
                    "axis",
                )
        torques = [
            rotor.thrust_coefficient * np.cross(rotor.position, rotor.axis)[2]
            + rotor.torque_sign * rotor.torque_coefficient * rotor.axis[2]
            for rotor in self.rotors
        ]
        if min(torques) > 0 or max(torques) < 0:
            text = (
                "all turn the vehicle about z in the same direction, it cannot hold its yaw angle: "
                "change turns of some"
            )
            yield warning(text, "rotors")


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

    def read_values(self, data: JsonObject) -> dict[str, Any]:
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

    def read_hull(self, data: JsonObject, boxes: Sequence[Collision], mass: float) -> Hull:
        """Read what water acts on.

        The box around all boxes, the displaced volume and the drag coefficient.
        """
        volume = self.entry(data, "displaced_volume", "m3", mass / DEFAULT_DENSITY, low=0.0)
        drag = self.entry(data, "water_drag_coefficient", "1", 1.0, low=0.0)
        return Hull(edges_around(boxes), volume, drag)

    def read_rotor(self, common: JsonObject, value: Any, path: JsonPath) -> Rotor:
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

    def read_effects(self, data: JsonObject, common: JsonObject) -> RotorEffects:
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


#: columns of the table of rotors in the constants of the equations: position, axis, thrust and
#: signed torque coefficient
ROTOR_TABLE_COLUMNS = 8

#: rows of that table for each rotor are filled up to a multiple of this number
_TABLE_ROW_MULTIPLE = 8


def variables(airframe: Airframe, rotor_slots: int | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs, in the order of the equations.

    Parameters other than `initial.*` start at the values of the airframe.

    Args:
        airframe: Data of the multirotor.
        rotor_slots: Number of elements of the arrays of the rotors. None means the number of
            rotors.
    """
    count, limit = len(airframe.rotors), f"0 ... {airframe.max_rotor_speed:.4g} rad/s"
    slots = count if rotor_slots is None else rotor_slots
    labels = element_labels([rotor.label for rotor in airframe.rotors], slots, "rotor_count")
    ground = "fraction of the ground effect; 0: none"
    return (
        *initial_variables("xyz", "uvw", "pqr"),
        # `Airframe` checks the values of mass and inertia
        *inertia_variables(airframe.mass, airframe.inertia, "total mass with rotors and payload"),
        scalar_variable(
            "gravity", "m/s2", "gravitational acceleration", "parameter", airframe.gravity
        ),
        *attribute_parameters(airframe.hull, _HULL_PARAMETERS),
        parameter("rotor_count", "1", float(count), "number of rotors", 1.0, float(slots)),
        *element_parameters("rotor", airframe.rotors, _ROTOR_COLUMNS, slots),
        *attribute_parameters(airframe, _ROTOR_PARAMETERS),
        parameter(
            "initial_rotor_speed", "rad/s", 0.0, "initial speed of all rotors, if they lag", 0.0
        ),
        *attribute_parameters(airframe.effects, _EFFECT_PARAMETERS),
        parameter("ground_effect", "1", airframe.effects.ground_effect, ground, 0.0, 1.0),
        *attribute_parameters(airframe.effects, _LIFT_PARAMETERS),
        *EXTERNAL_LOADS,
        element_commands(
            "rotor_speed",
            "rad/s",
            f"commanded rotor speeds ({labels}), limited to {limit}",
            slots,
        ),
        *WIND_INPUTS,
        *GROUND_INPUTS,
        *WATER_LEVEL_INPUT,
        *CURRENT_INPUTS,
        *MOTION_OUTPUTS,
        *WORLD_OUTPUTS,
    )


def states(rotor_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of the rigid body, then the rotor speeds."""
    return (*FREE_STATES, *element_states("rotor_speed", rotor_slots))


def table_rows(rotor_slots: int) -> int:
    """Return the number of rows of the table of rotors."""
    return -(-rotor_slots // _TABLE_ROW_MULTIPLE) * _TABLE_ROW_MULTIPLE


#: attribute, and name, unit, smallest value and description of its parameter
_HULL_PARAMETERS = (
    ("size", "hull_size", "m", 0.0, "edge of the box around the body, for forces in water"),
    (
        "volume",
        "displaced_volume",
        "m3",
        0.0,
        "volume of water that the submerged vehicle displaces",
    ),
    (
        "drag_coefficient",
        "water_drag_coefficient",
        "1",
        0.0,
        "drag coefficient of the body in water",
    ),
)
_ROTOR_PARAMETERS = (
    ("max_rotor_speed", "max_rotor_speed", "rad/s", 0.0, "upper limit of the rotor speeds"),
    ("rotor_radius", "rotor_radius", "m", 0.0, "radius of the rotors"),
)
_EFFECT_PARAMETERS = (
    (
        "rotor_time_constant",
        "rotor_time_constant",
        "s",
        0.0,
        "time constant of the rotor speeds; 0: no lag",
    ),
    (
        "rotor_inertia",
        "rotor_inertia",
        "kg.m2",
        0.0,
        "moment of inertia of a rotor with its motor; 0: no gyroscopic torque",
    ),
    ("rotor_drag", "rotor_drag", "kg/rad", 0.0, "drag of a rotor over its speed and air speed"),
    ("body_drag", "body_drag", "kg/m", 0.0, "drag of the body over squared air speed"),
)
_LIFT_PARAMETERS = (
    (
        "translational_lift",
        "translational_lift",
        "kg/m",
        0.0,
        "thrust of a rotor over the squared air speed in its plane",
    ),
)

#: attribute of a rotor, and name, unit and description of its array
_ROTOR_COLUMNS = (
    ("position", "rotor_position", "m", "position of the hubs"),
    ("axis", "rotor_axis", "1", "unit vectors of the thrusts"),
    ("thrust_coefficient", "thrust_coefficient", "N.s2/rad2", "thrust over squared speed"),
    (
        "signed_torque_coefficient",
        "torque_coefficient",
        "N.m.s2/rad2",
        "signed reaction torque on the body about the axis over squared speed; this sign counts "
        "for the torque",
    ),
    (
        "torque_sign",
        "torque_sign",
        "1",
        "1: clockwise seen from the tip of the axis, -1: counter-clockwise; counts for rotor "
        "inertia only",
    ),
)
