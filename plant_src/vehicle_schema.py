"""JSON Schema of vehicle files, for editors; the readers of the families check the values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from .catalogue import COMMON_KEYS
from .vehicles.common.quantities import TEXT_KEYS
from .vehicles.multirotor import vehicle_data as multirotor
from .vehicles.submerged import vehicle_data as submerged

Schema = dict[str, Any]

_TEXT: Schema = {"type": "string"}
_MATRIX_ROW: Schema = {"type": "array", "items": {"type": "number"}}


def vehicle_schema() -> Schema:
    """Return the JSON Schema of the files of all families."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Vehicle",
        "type": "object",
        "required": ["family"],
        "properties": {"family": {"enum": ["multirotor", "submerged"]}},
        "oneOf": [_multirotor_schema(), _submerged_schema()],
    }


def _multirotor_schema() -> Schema:
    rotor = _object(
        {
            **_rotor_coefficients(),
            "radius": _quantity("m", "radius of the rotors", positive=True),
            "max_speed": _quantity("rad/s", "upper limit of the rotor speeds", positive=True),
            "time_constant": _quantity("s", "first-order lag of the rotor speeds"),
            "inertia": _quantity("kg.m2", "moment of inertia of a rotor with its motor"),
            "drag": _vector("kg/rad", "force per rotor speed and air speed along x, y, z", 3),
            "translational_lift": _quantity("kg/m", "thrust over the squared air speed in the plane of the rotor"),
        },
        multirotor.ROTOR_KEYS,
    )
    each = _object({**_place("hub", "thrust"), **_turns(), **_rotor_coefficients()}, ("position", "turns"))
    return _family(
        "multirotor",
        {
            "rotor": {**rotor, "description": "what all rotors have in common"},
            "rotors": _list(each, "rotors in the order of the input rotor_speed", 16),
            "body_drag": _vector("kg/m", "force per squared air speed along x, y, z", 3),
            "ground_effect": _quantity("1", "fraction of the ground effect, 0 to 1"),
            "displaced_volume": _quantity("m3", "volume of water that the submerged vehicle displaces"),
            "water_drag_coefficient": _quantity("1", "drag coefficient in water of the box around all boxes"),
        },
        multirotor.KEYS,
    )


def _submerged_schema() -> Schema:
    coefficients = {
        **_rotor_coefficients(),
        "reverse_thrust_coefficient": _quantity("N.s2/rad2", "thrust over squared speed at negative speeds"),
    }
    thruster = _object(
        {
            **coefficients,
            "radius": _quantity("m", "radius of the propellers", positive=True),
            "max_speed": _quantity("rad/s", "largest magnitude of the speeds", positive=True),
            "time_constant": _quantity("s", "first-order lag of the speeds"),
            "advance_coefficient": _quantity("kg/rad", "loss of thrust over speed and axial velocity of the water"),
        },
        submerged.THRUSTER_KEYS,
    )
    each = _object(
        {**_place("centre of the propeller", "thrust at a positive speed"), **_turns(), **coefficients}, ("position", "axis")
    )
    matrices = {
        name: _matrix(text, 6)
        for name, text in (
            ("added_mass", "added mass about the centre of mass for u, v, w, p, q, r: diagonal or six rows"),
            ("linear_damping", "load over velocity: diagonal or six rows"),
            ("quadratic_damping", "load over squared velocity: diagonal or six rows"),
        )
    }
    return _family(
        "submerged",
        {
            **matrices,
            "displaced_volume": _quantity("m3", "volume of water that the submerged vehicle displaces", positive=True),
            "centre_of_buoyancy": _vector("m", "centre of this volume", 3),
            "size": _vector("m", "edges of the box over which this volume is distributed", 3),
            "water_density": _quantity("kg/m3", "density of the water", positive=True),
            "thruster": {**thruster, "description": "what all thrusters have in common"},
            "thrusters": _list(each, "thrusters in the order of the input thruster_speed", 16),
        },
        submerged.KEYS,
    )


def _family(name: str, properties: Mapping[str, Schema], required: tuple[str, ...]) -> Schema:
    box = _object(
        {
            "size": _vector("m", "edges", 3),
            "position": _vector("m", "centre, body frame", 3),
            "yaw": _quantity("rad", "angle about the z axis", signed=True),
        },
        ("size",),
    )
    common = {
        **dict.fromkeys(COMMON_KEYS, _TEXT),
        "family": {"const": name},
        "sources": {"type": "object", "additionalProperties": _TEXT, "description": "name of a source to its description"},
        "mass": _quantity("kg", "total mass", positive=True),
        "inertia": _matrix("inertia about the centre of mass: [xx, yy, zz], or three rows", 3, "kg.m2"),
        "gravity": _quantity("m/s2", "gravitational acceleration", positive=True),
        "crash_speed": _quantity("m/s", "change of velocity by a collision above which the vehicle has crashed", positive=True),
        "boxes": _list(box, "collision shape", None),
    }
    return {"title": name, **_object({**common, **properties}, ("family", *required))}


def _object(properties: Mapping[str, Schema], required: tuple[str, ...]) -> Schema:
    texts = dict.fromkeys(TEXT_KEYS, _TEXT)
    return {
        "type": "object",
        "properties": {**texts, **properties},
        "required": list(required),
        "additionalProperties": False,
    }


def _list(items: Schema, description: str, longest: int | None) -> Schema:
    limit = {} if longest is None else {"maxItems": longest}
    return {"type": "array", "items": items, "minItems": 1, **limit, "description": description}


def _rotor_coefficients() -> dict[str, Schema]:
    return {
        "thrust_coefficient": _quantity("N.s2/rad2", "thrust over squared speed"),
        "torque_coefficient": _quantity("N.m.s2/rad2", "reaction torque over squared speed"),
    }


def _place(hub: str, thrust: str) -> dict[str, Schema]:
    return {
        "position": _vector("m", f"{hub}, body frame", 3),
        "axis": _vector("1", f"direction of the {thrust}, body frame", 3),
        "label": {**_TEXT, "description": "place in words"},
    }


def _turns() -> dict[str, Schema]:
    text = "sense of rotation, seen from the side to which the thrust points"
    return {"turns": {"enum": ["clockwise", "counter-clockwise"], "description": text}}


def _quantity(unit: str, description: str, *, positive: bool = False, signed: bool = False) -> Schema:
    """Return the schema of a number, or of an object with value, unit and source."""
    number: Schema = {"type": "number"}
    if not signed:
        number["exclusiveMinimum" if positive else "minimum"] = 0
    return _with_unit(number, unit, description)


def _vector(unit: str, description: str, size: int) -> Schema:
    return _with_unit({"type": "array", "items": {"type": "number"}, "minItems": size, "maxItems": size}, unit, description)


def _matrix(description: str, size: int, unit: str = "SI units") -> Schema:
    rows = {"minItems": size, "maxItems": size}
    diagonal: Schema = {**_MATRIX_ROW, **rows}
    return _with_unit({"anyOf": [diagonal, {"type": "array", "items": diagonal, **rows}]}, unit, description)


def _with_unit(value: Schema, unit: str, description: str) -> Schema:
    given = _object({"value": {**value, "description": "in `unit`"}, "unit": _TEXT}, ("value",))
    return {"anyOf": [value, given], "description": f"{description} [{unit}]"}
