"""The scene of the 3-D replay, described by the components of a scenario.

A Python component class may describe its scene by a static method `scene(name, scenario) -> dict`.
A scenario of other components names a function `(scenario, **arguments) -> dict` under its key
"scene". `name` is that of the component; `scenario` is the scenario as JSON, where "components"
includes those of nested systems by their full names. The returned dict is JSON as well, with any of
these keys (m, rad; world frame east-north-up; colours as in CSS):

- `bodies`: {"name", "title", "colour", "position": [x, y, z], "orientation": [w, x, y, z] or
  "attitude": [roll, pitch, yaw], "parts"}; position, orientation and attitude are names of signals,
  their negatives ("-name"), or numbers
- `parts` of a body, and `fixed`: {"shape", "size", "position", "orientation": [x, y, z, w],
  "colour": [r, g, b] in 0 ... 1, "opacity"}; all but the first two have defaults. The size of a
  "box" is its edge lengths, of a "cylinder" (along z) radius and length, of a "cone" lower and
  upper radius and length, of a "sphere" its radius, of a "ring" radius and thickness, of a "mesh"
  the coordinates of the corners of its triangles, nine numbers each
- `water`, at z = 0: {"waves": [{"amplitude", "frequency", "number", "direction", "phase"}], "gain":
  signal or number}
- `markers`: {"position", "radius", "label"}; `views`: {"name", "on": a body, "eye", "target"} in
  axes that turn with its yaw
- `spans`: {"signal", "label", "colour"} for a Boolean signal; `plots`: lists of patterns of signals
- `marks`: {"signal", "label", "colour", "on": a body}: the moment at which a Boolean signal first
  becomes true, such as a crash
"""

import json
from collections.abc import Callable, Iterator, Mapping
from inspect import getattr_static
from pathlib import Path
from typing import Any

from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, InputError, did_you_mean
from ..core.json_values import JsonObject
from ..results.files import to_json_types
from ..scenario.component_sources import kind_of
from ..scenario.extension import nested_content
from ..scenario.named_functions import load_function

LIST_KEYS = ("bodies", "fixed", "markers", "views", "spans", "marks", "plots")

#: number of elements of the size of each shape; a mesh has that of each of its triangles
SHAPE_SIZES: Mapping[str, int] = {
    "box": 3,
    "cylinder": 2,
    "cone": 3,
    "sphere": 1,
    "ring": 2,
    "mesh": 9,
}

_BODY_DEFAULTS: Mapping[str, Any] = {"colour": "#0072b2", "parts": ()}
_PART_DEFAULTS: Mapping[str, Any] = {
    "position": (0, 0, 0),
    "orientation": (0, 0, 0, 1),
    "colour": (0.6, 0.6, 0.6),
    "opacity": 1,
}


def build_scene(metadata: JsonObject) -> dict[str, Any]:
    """Return the scene of a run; it is empty if no component describes one.

    Args:
        metadata: The metadata of the run, as in run.json.

    Raises:
        InputError: A file or function that the scenario names does not exist.
        ComponentError: A scene function fails or returns an invalid scene.
    """
    scene: dict[str, Any] = {**{key: [] for key in LIST_KEYS}, "water": None}
    if "scenario_file" not in metadata:
        return scene
    for part in _scene_parts(metadata.get("scenario", {}), Path(metadata["scenario_file"]).parent):
        for key in LIST_KEYS:
            scene[key] += part.get(key, [])
        scene["water"] = scene["water"] or part.get("water")
    return scene


def _scene_parts(scenario: JsonObject, folder: Path) -> Iterator[dict[str, Any]]:
    """Yield the scenes that the components and the scenario itself describe."""
    components = list(flatten_components(scenario, folder))
    flat = {**scenario, "components": {name: component for name, component, _ in components}}
    for name, component, component_folder in components:
        if function := static_method(component, component_folder, "scene"):
            yield _call_scene_function(f'component "{name}"', function, name, flat)
    if spec := scenario.get("scene"):
        yield _call_scene_function(
            "the scenario's scene",
            load_function(spec["python"], folder),
            flat,
            **spec.get("arguments", {}),
        )


def static_method(component: JsonObject, folder: Path, name: str) -> Callable[..., Any] | None:
    """Return a static method of a Python component's class.

    None if there is none, or the component is not a Python class.

    Args:
        component: The component as in a scenario file.
        folder: The folder that its paths start from.
        name: The name of the method.

    Raises:
        InputError: The file or the class does not exist.
    """
    method = getattr_static(kind_of(component).python_class(component, folder), name, None)
    return method if isinstance(method, staticmethod) else None


def flatten_components(
    system: JsonObject, folder: Path
) -> Iterator[tuple[str, dict[str, Any], Path]]:
    """Yield full name, component and folder of its paths of all components.

    Those of nested systems are included.

    Parameters that an outer system sets ("usv.waypoint_x") are added to the inner component.
    """
    for name, component in system.get("components", {}).items():
        nested = nested_content(component, folder)
        if nested is None:
            yield name, component, folder
            continue
        for inner, leaf, leaf_folder in flatten_components(*nested):
            parameters = component.get("parameters", {}).items()
            outer = {
                key.removeprefix(f"{inner}."): value
                for key, value in parameters
                if key.startswith(f"{inner}.")
            }
            yield (
                f"{name}.{inner}",
                {**leaf, "parameters": {**leaf.get("parameters", {}), **outer}},
                leaf_folder,
            )


def _call_scene_function(
    owner: str, function: Callable[..., Any], *values: Any, **named: Any
) -> dict[str, Any]:
    """Return the scene of a user's function; any exception becomes a ComponentError of `owner`."""
    try:
        scene = function(*values, **named)
        if not isinstance(scene, dict):
            raise TypeError(f"returned {type(scene).__name__}, expected a dict")
        json.dumps(to_json_types(scene))
        return _with_defaults(scene)
    except (InputError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise ComponentError(owner, "scene", f"{type(error).__name__}: {error}") from error


def _with_defaults(scene: JsonObject) -> dict[str, Any]:
    """Return the scene with the defaults of missing keys.

    Raise TypeError or ValueError if it cannot be drawn.
    """
    if unknown := [key for key in scene if key not in (*LIST_KEYS, "water")]:
        raise ValueError(
            f'unknown key "{unknown[0]}"{did_you_mean(unknown[0], (*LIST_KEYS, "water"))}'
        )
    bodies = [
        {**_BODY_DEFAULTS, "title": body.get("name"), **body} for body in scene.get("bodies", [])
    ]
    for body in bodies:
        body["parts"] = [_part_with_defaults(part) for part in body["parts"]]
        if missing := [key for key in ("name", "position") if key not in body]:
            raise ValueError(f'a body has no "{missing[0]}"')
        if ("orientation" in body) == ("attitude" in body):
            raise ValueError(f'body "{body["name"]}" needs either "orientation" or "attitude"')
    return {
        **scene,
        "bodies": bodies,
        "fixed": [_part_with_defaults(part) for part in scene.get("fixed", [])],
    }


def _part_with_defaults(part: JsonObject) -> dict[str, Any]:
    shape, size = str(part.get("shape")), part.get("size", ())
    if shape not in SHAPE_SIZES:
        raise ValueError(f'unknown shape "{shape}"{did_you_mean(shape, SHAPE_SIZES)}')
    if shape == "mesh":
        if not size or len(size) % 9:
            raise ValueError(
                f"a mesh has nine numbers for each triangle as its size, found {len(size)} numbers"
            )
    elif len(size) != SHAPE_SIZES[shape]:
        raise ValueError(
            f"a {shape} has {SHAPE_SIZES[shape]} numbers as its size, found {list(size)}"
        )
    return {**_PART_DEFAULTS, **part}
