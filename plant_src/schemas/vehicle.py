"""JSON Schema of vehicle files, for editors; the readers of the families check the values."""

from __future__ import annotations

from ..catalogue import FAMILIES
from ..vehicles.multirotor import airframe as multirotor
from ..vehicles.submerged import craft as submerged
from .parts import (
    Schema,
    family_schema,
    list_schema,
    matrix_schema,
    object_schema,
    placed_schema,
    quantity_schema,
    vector_schema,
)
from .vessel import planar_vessel_schema, surface_vessel_schema


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
