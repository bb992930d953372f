"""Parts of the JSON Schema of vehicle files."""

from collections.abc import Mapping
from typing import Any

from ..catalogue import COMMON_KEYS
from ..vehicles.common.vehicle_reader import TEXT_KEYS

Schema = dict[str, Any]

TEXT: Schema = {"type": "string"}
NUMBER: Schema = {"type": "number"}
POSITIVE: Schema = {"type": "number", "exclusiveMinimum": 0}
AT_LEAST_0: Schema = {"type": "number", "minimum": 0}
_MATRIX_ROW: Schema = {"type": "array", "items": {"type": "number"}}


def family_schema(name: str, properties: Mapping[str, Schema], required: tuple[str, ...]) -> Schema:
    """Return the schema of the files of a family."""
    box = object_schema(
        {
            "size": vector_schema("m", "edges", 3),
            "position": vector_schema("m", "centre, body frame", 3),
            "yaw": quantity_schema("rad", "angle about the z axis", signed=True),
        },
        ("size",),
    )
    rows: Schema = {
        "type": "array",
        "items": {**_MATRIX_ROW, "minItems": 3, "maxItems": 3},
        "minItems": 1,
    }
    points = {
        **rows,
        "minItems": 4,
        "description": "points whose convex hull the piece is, body frame [m]",
    }
    piece = object_schema({"points": points}, ("points",))
    common = {
        **dict.fromkeys(COMMON_KEYS, TEXT),
        "family": {"const": name},
        "sources": {
            "type": "object",
            "additionalProperties": TEXT,
            "description": "name of a source to its description",
        },
        "mass": quantity_schema("kg", "total mass", positive=True),
        "inertia": matrix_schema(
            "inertia about the centre of mass: [xx, yy, zz], or three rows", 3, "kg.m2"
        ),
        "crash_speed": quantity_schema(
            "m/s",
            "change of velocity by a collision above which the vehicle has crashed",
            positive=True,
        ),
        "boxes": list_schema(
            {"anyOf": [box, piece]}, "collision shape: boxes and convex pieces", None
        ),
        "visual": object_schema({"vertices": rows, "faces": rows}, ("vertices", "faces")),
    }
    return {"title": name, **object_schema({**common, **properties}, ("family", *required))}


def object_schema(properties: Mapping[str, Schema], required: tuple[str, ...] = ()) -> Schema:
    """Return the schema of an object with these keys and texts, and no others."""
    texts = dict.fromkeys(TEXT_KEYS, TEXT)
    return {
        "type": "object",
        "properties": {**texts, **properties},
        "required": list(required),
        "additionalProperties": False,
    }


def list_schema(items: Schema, description: str, longest: int | None) -> Schema:
    """Return the schema of a list with at least one element."""
    limit = {} if longest is None else {"maxItems": longest}
    return {"type": "array", "items": items, "minItems": 1, **limit, "description": description}


def placed_schema(
    hub: str, thrust: str, properties: Mapping[str, Schema], required: tuple[str, ...]
) -> Schema:
    """Return the schema of a rotor, thruster or propeller.

    It has a place, or a link of a URDF file in place of it.

    Args:
        hub: The point at `position`, in words.
        thrust: The force along `axis`, in words.
        properties: Other keys.
        required: Required keys; a link stands for position and axis.
    """
    place = {
        "position": vector_schema("m", f"{hub}, body frame", 3),
        "axis": vector_schema("1", f"direction of the {thrust}, body frame", 3),
        "label": {**TEXT, "description": "place in words"},
    }
    link = {
        **TEXT,
        "description": (
            "link of the URDF file in place of position and axis, for `cosim new vehicle --urdf`"
        ),
    }
    schema = object_schema({**place, "link": link, **properties})
    others = [key for key in required if key not in ("position", "axis")]
    del schema["required"]
    return {**schema, "anyOf": [{"required": list(required)}, {"required": ["link", *others]}]}


def quantity_schema(
    unit: str, description: str, *, positive: bool = False, signed: bool = False
) -> Schema:
    """Return the schema of a number, or of an object with value, unit and source."""
    number: Schema = {"type": "number"}
    if not signed:
        number["exclusiveMinimum" if positive else "minimum"] = 0
    return with_unit(number, unit, description)


def vector_schema(unit: str, description: str, size: int) -> Schema:
    """Return the schema of a list of numbers."""
    return with_unit(
        {"type": "array", "items": {"type": "number"}, "minItems": size, "maxItems": size},
        unit,
        description,
    )


def matrix_schema(description: str, size: int, unit: str = "SI units") -> Schema:
    """Return the schema of the diagonal of a matrix, or of its rows."""
    rows = {"minItems": size, "maxItems": size}
    diagonal: Schema = {**_MATRIX_ROW, **rows}
    return with_unit(
        {"anyOf": [diagonal, {"type": "array", "items": diagonal, **rows}]}, unit, description
    )


def with_unit(value: Schema, unit: str, description: str) -> Schema:
    """Return the schema of a value, or of an object with value, unit and source."""
    given = object_schema(
        {"value": {**value, "description": "in `unit`"}, "unit": TEXT}, ("value",)
    )
    return {"anyOf": [value, given], "description": f"{description} [{unit}]"}


def documented_object(
    description: str, properties: dict[str, Schema], required: tuple[str, ...] = ()
) -> Schema:
    """Return the schema of an object with exactly these keys, for the reference and editors."""
    return {
        "type": "object",
        "description": description,
        "properties": properties,
        "required": list(required),
        "additionalProperties": False,
    }


def reference(kind: str) -> Schema:
    """Return a reference to the schema `kind` of the same file."""
    return {"$ref": f"#/$defs/{kind}"}


def documented_part(kind: str, description: str, example: Schema) -> Schema:
    """Return the schema of an object of a kind of the same file."""
    return {**reference(kind), "description": description, "examples": [example]}


def documented_value(
    kind: Schema, description: str, unit: str, example: float, default: float | None = None
) -> Schema:
    """Return the schema of a value with what the reference shows of it; no default: None."""
    shown: Schema = {} if default is None else {"default": default}
    return {**kind, "description": description, "unit": unit, "examples": [example], **shown}


def documented_vector(
    description: str,
    unit: str,
    example: list[float],
    default: list[float] | None = None,
    *,
    least: int | None = None,
    most: int | None = None,
) -> Schema:
    """Return the schema of a list of numbers, as long as the example or from `least` to `most`."""
    size = {"minItems": least or len(example), "maxItems": most or len(example)}
    shown: Schema = {} if default is None else {"default": default}
    return {
        "type": "array",
        "items": NUMBER,
        **size,
        "description": description,
        "unit": unit,
        "examples": [example],
        **shown,
    }
