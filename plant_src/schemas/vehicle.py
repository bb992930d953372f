"""JSON Schema of vehicle files, for editors; the readers of the families check the values."""

from ..catalogue import FAMILIES
from ..vehicles.multirotor import airframe as multirotor
from ..vehicles.planar_vessel import planar_vessel as planar
from ..vehicles.submerged import craft as submerged
from ..vehicles.surface_vessel import surface_vessel as surface
from ..vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS
from .schema_parts import (
    TEXT,
    Schema,
    family_schema,
    list_schema,
    matrix_schema,
    object_schema,
    placed_schema,
    quantity_schema,
    vector_schema,
)


def surface_vessel_schema() -> Schema:
    """Return the schema of floating vessels."""
    velocities = "for u, v, w, p, q, r about the origin"
    return family_schema(
        "surface_vessel",
        {
            **_vessel_properties(6, velocities),
            "quadratic_damping": matrix_schema(
                f"load over squared velocity, {velocities}: diagonal or six rows", 6
            ),
            "hull": _hull_schema(),
        },
        surface.KEYS,
    )


def planar_vessel_schema() -> Schema:
    """Return the schema of planar vessels."""
    velocities = "for u, v, r about the origin"
    matrices = {
        letter: matrix_schema(f"load over |{letter}| times velocity: diagonal or three rows", 3)
        for letter in "uvr"
    }
    quadratic = matrix_schema(
        f"load over squared velocity, {velocities}: diagonal or three rows", 3
    )
    family = family_schema(
        "planar_vessel",
        {
            **_vessel_properties(3, velocities),
            "yaw_inertia": quantity_schema(
                "kg.m2", "moment of inertia about the vertical axis, centre of mass", positive=True
            ),
            "height": quantity_schema(
                "m", "height of the origin above the still water", signed=True
            ),
            "quadratic_damping": {"anyOf": [*quadratic["anyOf"], object_schema(matrices)]},
            "cubic_damping": vector_schema(
                "SI units", f"load over cubed velocity, {velocities}", 3
            ),
        },
        planar.KEYS,
    )
    del family["properties"]["inertia"]
    return family


def _vessel_properties(size: int, velocities: str) -> dict[str, Schema]:
    quantities = _propeller_quantities()
    each = placed_schema(
        "centre of the propeller", "thrust at a positive speed", quantities, ("position",)
    )
    return {
        "centre_of_mass": vector_schema("m", "centre of mass from the origin", 3),
        "added_mass": matrix_schema(f"added mass, {velocities}: diagonal or rows", size),
        "coriolis_added_mass": matrix_schema(
            "added mass whose Coriolis loads the damping does not contain; default: all", size
        ),
        "linear_damping": matrix_schema(
            f"load over velocity, {velocities}: diagonal or rows", size
        ),
        "air_drag": vector_schema("kg/m", "force over squared air velocity along x and y", 2),
        "air_centre": vector_schema(
            "m", "point at which the air drag acts; default: centre of mass", 3
        ),
        "deck_centre": vector_schema(
            "m", "centre of the top of the landing deck; default: top of the highest box", 3
        ),
        "propeller": {
            **object_schema(quantities),
            "description": "what all propellers have in common",
        },
        "propellers": list_schema(
            each,
            "propellers and thrusters in the order of the input propeller_speed",
            MAX_PROPELLERS,
        ),
        "rudders": {
            **list_schema(
                _rudder_schema(), "rudders in the order of the input rudder_angle", MAX_RUDDERS
            ),
            "minItems": 0,
        },
        "water_density": quantity_schema("kg/m3", "density of the water", positive=True),
    }


def _propeller_quantities() -> dict[str, Schema]:
    return {
        "thrust_coefficient": quantity_schema("N.s2/rad2", "thrust over squared speed"),
        "reverse_thrust_coefficient": quantity_schema("N.s2/rad2", "the same at negative speeds"),
        "max_speed": quantity_schema("rad/s", "largest speed"),
        "max_reverse_speed": quantity_schema("rad/s", "largest magnitude of negative speeds"),
        "time_constant": quantity_schema("s", "first-order lag of the speed; 0: none"),
        "radius": quantity_schema(
            "m",
            "radius: thrust fades as the propeller emerges, and rudders feel its race; 0: neither",
        ),
        "advance_coefficient": quantity_schema(
            "kg/rad", "loss of thrust over speed and axial velocity of the water"
        ),
        "max_azimuth": quantity_schema("rad", "largest azimuth angle; 0: the axis is fixed"),
    }


def _rudder_schema() -> Schema:
    return object_schema(
        {
            "label": {**TEXT, "description": "place in words"},
            "position": vector_schema("m", "centre of pressure, body frame", 3),
            "area": quantity_schema("m2", "area", positive=True),
            "max_lift_coefficient": quantity_schema(
                "1", "lift coefficient at and beyond the stall angle", positive=True
            ),
            "stall_angle": quantity_schema(
                "rad", "angle of attack beyond which the lift is constant", positive=True
            ),
            "max_angle": quantity_schema("rad", "largest rudder angle"),
            "propeller": {
                "type": "integer",
                "minimum": 0,
                "description": "propeller in whose race the rudder is, from 1; 0: none",
            },
        },
        ("position", "area"),
    )


def _hull_schema() -> Schema:
    schema = object_schema(
        {
            "count": {"enum": [1, 2], "description": "number of hulls"},
            "length": quantity_schema("m", "length of the waterline", positive=True),
            "beam": quantity_schema("m", "beam of each hull", positive=True),
            "depth": quantity_schema(
                "m", "height of the hulls from the bottom to the deck edge", positive=True
            ),
            "bottom": quantity_schema("m", "height of the bottom above the origin", signed=True),
            "offset": quantity_schema(
                "m", "distance of the centre lines of two hulls from the middle"
            ),
            "waterplane_centre": quantity_schema(
                "m", "centre of the waterplane ahead of the origin", signed=True
            ),
            "waterplane_coefficient": quantity_schema(
                "1", "area of the waterplane of each hull over length times beam", positive=True
            ),
            "transverse_moment": quantity_schema(
                "m4", "second moment of the waterplane about the x axis", positive=True
            ),
            "longitudinal_moment": quantity_schema(
                "m4", "second moment of the waterplane about the y axis", positive=True
            ),
            "vertical_drag_coefficient": quantity_schema("1", "drag coefficient of the bottoms"),
            "cross_flow_drag_coefficient": quantity_schema(
                "1", "drag coefficient of the immersed sides in cross-flow"
            ),
        },
        surface.HULL_KEYS,
    )
    two_hulls: Schema = {
        "if": {"properties": {"count": {"const": 2}}, "required": ["count"]},
        "then": {"required": ["offset"]},
    }
    return {**schema, **two_hulls, "description": "one hull or two equal ones"}


def vehicle_schema() -> Schema:
    """Return the JSON Schema of the files of all families."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Vehicle",
        "type": "object",
        "required": ["family"],
        "properties": {"family": {"enum": list(FAMILIES)}},
        "oneOf": [
            _multirotor_schema(),
            _submerged_schema(),
            surface_vessel_schema(),
            planar_vessel_schema(),
        ],
    }


def _multirotor_schema() -> Schema:
    rotor = object_schema(
        {
            **_rotor_coefficients(),
            "radius": quantity_schema("m", "radius of the rotors", positive=True),
            "max_speed": quantity_schema("rad/s", "upper limit of the rotor speeds", positive=True),
            "time_constant": quantity_schema("s", "first-order lag of the rotor speeds"),
            "inertia": quantity_schema("kg.m2", "moment of inertia of a rotor with its motor"),
            "drag": vector_schema("kg/rad", "force per rotor speed and air speed along x, y, z", 3),
            "translational_lift": quantity_schema(
                "kg/m", "thrust over the squared air speed in the plane of the rotor"
            ),
        },
        multirotor.ROTOR_KEYS,
    )
    each = placed_schema(
        "hub", "thrust", {**_turns(), **_rotor_coefficients()}, ("position", "turns")
    )
    return family_schema(
        "multirotor",
        {
            "rotor": {**rotor, "description": "what all rotors have in common"},
            "rotors": list_schema(each, "rotors in the order of the input rotor_speed", 16),
            "gravity": _gravity(),
            "body_drag": vector_schema("kg/m", "force per squared air speed along x, y, z", 3),
            "ground_effect": quantity_schema("1", "fraction of the ground effect, 0 to 1"),
            "displaced_volume": quantity_schema(
                "m3", "volume of water that the submerged vehicle displaces"
            ),
            "water_drag_coefficient": quantity_schema(
                "1", "drag coefficient in water of the box around all boxes"
            ),
        },
        multirotor.KEYS,
    )


def _submerged_schema() -> Schema:
    coefficients = {
        **_rotor_coefficients(),
        "reverse_thrust_coefficient": quantity_schema(
            "N.s2/rad2", "thrust over squared speed at negative speeds"
        ),
    }
    thruster = object_schema(
        {
            **coefficients,
            "radius": quantity_schema("m", "radius of the propellers", positive=True),
            "max_speed": quantity_schema("rad/s", "largest magnitude of the speeds", positive=True),
            "time_constant": quantity_schema("s", "first-order lag of the speeds"),
            "advance_coefficient": quantity_schema(
                "kg/rad", "loss of thrust over speed and axial velocity of the water"
            ),
        },
        submerged.THRUSTER_KEYS,
    )
    keys = {**_turns(), **coefficients}
    each = placed_schema(
        "centre of the propeller", "thrust at a positive speed", keys, ("position", "axis")
    )
    matrices = {
        name: matrix_schema(text, 6)
        for name, text in (
            (
                "added_mass",
                "added mass about the centre of mass for u, v, w, p, q, r: diagonal or six rows",
            ),
            ("linear_damping", "load over velocity: diagonal or six rows"),
            ("quadratic_damping", "load over squared velocity: diagonal or six rows"),
        )
    }
    return family_schema(
        "submerged",
        {
            **matrices,
            "gravity": _gravity(),
            "displaced_volume": quantity_schema(
                "m3", "volume of water that the submerged vehicle displaces", positive=True
            ),
            "centre_of_buoyancy": vector_schema("m", "centre of this volume", 3),
            "size": vector_schema("m", "edges of the box over which this volume is distributed", 3),
            "water_density": quantity_schema("kg/m3", "density of the water", positive=True),
            "thruster": {**thruster, "description": "what all thrusters have in common"},
            "thrusters": list_schema(
                each, "thrusters in the order of the input thruster_speed", 16
            ),
        },
        submerged.KEYS,
    )


def _gravity() -> Schema:
    return quantity_schema("m/s2", "gravitational acceleration", positive=True)


def _rotor_coefficients() -> dict[str, Schema]:
    return {
        "thrust_coefficient": quantity_schema("N.s2/rad2", "thrust over squared speed"),
        "torque_coefficient": quantity_schema("N.m.s2/rad2", "reaction torque over squared speed"),
    }


def _turns() -> dict[str, Schema]:
    text = "sense of rotation, seen from the side to which the thrust points"
    return {"turns": {"enum": ["clockwise", "counter-clockwise"], "description": text}}
