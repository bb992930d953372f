"""JSON Schema of the arguments of a world, for editors and the reference.

`world_settings` checks the values.

Defaults, limits and lists of names are those of the readers.
"""

from ..placement import CONCRETE, DRY
from .environment import ENVIRONMENT_SCHEMAS
from .schema_parts import (
    AT_LEAST_0,
    NUMBER,
    POSITIVE,
    Schema,
    documented_object,
    documented_part,
    documented_value,
    documented_vector,
    reference,
)


def world_schema() -> Schema:
    """Return the JSON Schema of the arguments of a world.

    The kinds of objects in them are under `$defs`.
    """
    root = documented_object(
        "Arguments of the plant `plant_src/world.py:World`.",
        {
            "vehicles": _named(
                "WorldVehicle",
                "vehicles by name; the variables of a vehicle V begin with `V.`",
                {"uav": {"model": "ar_drone", "position": [0, 0, 2]}},
            ),
            "platforms": _named(
                "WorldPlatform",
                "fixed boxes by name",
                {"start": {"size": [5, 5, 0.05], "position": [-7, 3, 0.45]}},
            ),
            "environment": documented_part(
                "WorldEnvironment",
                "waves, wind and current; without it, a calm without wind",
                {"seed": 1, "sea_state": 2, "wind": {"speed": 4}},
            ),
            "obstacles": _named(
                "WorldObstacle",
                "fixed meshes by name",
                {"harbour": {"mesh": "cosim:scenarios/meshes/harbour.json"}},
            ),
        },
        ("vehicles",),
    )
    kinds = {"WorldVehicle": _vehicle(), "WorldPlatform": _platform(), "WorldObstacle": _obstacle()}
    return {**root, "$defs": {**kinds, **ENVIRONMENT_SCHEMAS}}


def _vehicle() -> Schema:
    return documented_object(
        "Vehicle of a world. All keys but `model` and `position` are optional.",
        {
            "model": {
                "type": ["string", "object"],
                "description": (
                    "vehicle of the library (`cosim list models`), path of a vehicle file, or its "
                    "content"
                ),
                "examples": ["ar_drone"],
            },
            "position": documented_vector(
                "start of the centre of mass: [x, y, z], of a vessel [x, y]",
                "m",
                [0, 0, 2],
                least=2,
                most=3,
            ),
            "yaw": documented_value(
                NUMBER, "start heading, counter-clockwise from x", "rad", 1.57, 0.0
            ),
            "velocity_body": documented_vector(
                (
                    "start velocity along the body axes forward, left, up, to which that of the "
                    "waves is added; default: at rest"
                ),
                "m/s",
                [1, 0, 0],
            ),
            "rates": documented_vector(
                "start angular velocity in body axes; default: 0", "rad/s", [0, 0, 0.1]
            ),
            "motion": {
                "enum": ["planar", "6dof"],
                "description": (
                    "degrees of freedom of a vessel with both; default: the first one of the model"
                ),
                "examples": ["6dof"],
            },
            "hull": {
                "type": "string",
                "description": (
                    "name of one of the hulls of a model with several; default: its first one"
                ),
                "examples": ["paper"],
            },
            "parameters": {
                "type": "object",
                "description": (
                    "parameters of the model by name, arrays as lists; `cosim info MODEL` lists "
                    "them with units"
                ),
                "examples": [{"mass": 0.5}],
            },
            "crash_speed": documented_value(
                AT_LEAST_0,
                (
                    "change of velocity by a collision above which the vehicle has crashed; "
                    "default: that of the model"
                ),
                "m/s",
                2.0,
            ),
            **_surface(),
        },
        ("model", "position"),
    )


def _surface() -> dict[str, Schema]:
    ratio: Schema = {"type": "number", "minimum": 0, "maximum": 1}
    return {
        "friction": documented_value(
            AT_LEAST_0,
            "friction coefficient; the values of two bodies in contact are multiplied",
            "1",
            0.8,
            DRY.friction,
        ),
        "restitution": documented_value(
            ratio,
            "coefficient of restitution; the values of two bodies are multiplied",
            "1",
            0.1,
            DRY.restitution,
        ),
    }


def _platform() -> Schema:
    return documented_object(
        "Fixed box with axes parallel to those of the world.",
        {
            "size": documented_vector("edges along x, y, z", "m", [5, 5, 0.05]),
            "position": documented_vector("centre", "m", [-7, 3, 0.45]),
            **_surface(),
        },
        ("size", "position"),
    )


def _obstacle() -> Schema:
    return documented_object(
        "Fixed mesh, for example a harbour wall.",
        {
            "mesh": {
                "type": ["string", "object"],
                "description": "path of a mesh file, or an object with `vertices` (m) and `faces`",
                "examples": ["cosim:scenarios/meshes/harbour.json"],
            },
            "position": documented_vector("place of the mesh's origin", "m", [10, 0, 0], [0, 0, 0]),
            "yaw": documented_value(NUMBER, "rotation about z, counter-clockwise", "rad", 0.5, 0.0),
            "scale": documented_value(
                POSITIVE, "factor on all lengths of the mesh", "1", 0.001, 1.0
            ),
            "collision": {
                "enum": ["convex", "concave"],
                "description": (
                    "`convex`: each connected part collides as its convex hull; `concave`: the "
                    "triangles collide"
                ),
                "default": "convex",
                "examples": ["concave"],
            },
            "colour": documented_vector(
                "red, green, blue from 0 to 1", "1", [0.4, 0.4, 0.4], list(CONCRETE)
            ),
            **_surface(),
        },
        ("mesh",),
    )


def _named(kind: str, description: str, example: Schema) -> Schema:
    names = {
        "type": "object",
        "patternProperties": {r"^[A-Za-z_]\w*$": reference(kind)},
        "additionalProperties": False,
    }
    return {**names, "description": description, "examples": [example]}
