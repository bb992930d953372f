"""What to draw in the 3-D replay, asked from the components of a scenario: the importer itself knows no vehicle.

A Python component may say what it looks like by a static method `scene(name, scenario) -> dict`; a scenario of other components
names a function `(scenario, **arguments) -> dict` under its key "scene". `name` is the component's, `scenario` the scenario as
JSON, where "components" holds those of nested systems by their full names. The answer is JSON as well, with any of these keys
(m, rad, world frame z up; colours as CSS has them):

- `bodies`: {"name", "title", "colour", "position": [x, y, z], "orientation": [w, x, y, z] or "attitude": [roll, pitch, yaw],
  "parts"}; position, orientation and attitude are names of signals, their negatives ("-name"), or numbers
- `parts` of a body, and `fixed`: {"shape", "size", "position", "orientation": [x, y, z, w], "colour": [r, g, b] in 0 ... 1,
  "opacity"}, all but the first two have defaults; a "box" has its edges as size, a "cylinder" (along z) radius and length, a
  "cone" lower and upper radius and length, a "sphere" its radius, a "ring" radius and thickness
- `water`, at z = 0: {"waves": [{"amplitude", "frequency", "number", "direction", "phase"}], "gain": signal or number}
- `markers`: {"position", "radius", "label"}; `views`: {"name", "on": a body, "eye", "target"} in axes that turn with its yaw
- `spans`: {"signal", "label", "colour"}, a Boolean; `plots`: lists of patterns of signals
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from inspect import getattr_static
from pathlib import Path
from typing import Any

from ..components.python_import import load_object
from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, InputError, did_you_mean
from ..results.files import to_json_types
from ..scenario.json_document import read_document
from ..scenario.named_functions import load_function

LIST_KEYS = ("bodies", "fixed", "markers", "views", "spans", "plots")

#: shape -> how many numbers its size has
SHAPE_SIZES: Mapping[str, int] = {"box": 3, "cylinder": 2, "cone": 3, "sphere": 1, "ring": 2}

_BODY_DEFAULTS: Mapping[str, Any] = {"colour": "#0072b2", "parts": ()}
_PART_DEFAULTS: Mapping[str, Any] = {"position": (0, 0, 0), "orientation": (0, 0, 0, 1), "colour": (0.6, 0.6, 0.6), "opacity": 1}


def build_scene(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """The scene of a run, given what its run.json says; nothing to draw when no component says what it looks like.

    Raises InputError when something that the scenario names is not there, ComponentError when asking fails.
    """
    scene: dict[str, Any] = {**{key: [] for key in LIST_KEYS}, "water": None}
    if "scenario_file" not in metadata:
        return scene
    for part in _scene_parts(metadata["scenario"], Path(metadata["scenario_file"]).parent):
        for key in LIST_KEYS:
            scene[key] += part.get(key, [])
        scene["water"] = scene["water"] or part.get("water")
    return scene


def _scene_parts(scenario: Mapping[str, Any], folder: Path) -> Iterator[dict[str, Any]]:
    leaves = list(_flatten_components(scenario, folder))
    flat = {**scenario, "components": {name: component for name, component, _ in leaves}}
    for name, component, own_folder in leaves:
        if isinstance(reference := component.get("python"), str):
            ask = getattr_static(load_object(reference, own_folder), "scene", None)
            if isinstance(ask, staticmethod):
                yield _call_scene_function(f'component "{name}"', ask, name, flat)
    if spec := scenario.get("scene"):
        yield _call_scene_function(
            "the scenario's scene", load_function(spec["python"], folder), flat, **spec.get("arguments", {})
        )


def _flatten_components(system: Mapping[str, Any], folder: Path) -> Iterator[tuple[str, dict[str, Any], Path]]:
    """(full name, component, where its paths start) of all components, those of nested systems instead of these.

    Parameters that are set from outside ("usv.waypoint_x") reach the components inside.
    """
    for name, component in system.get("components", {}).items():
        if "system" not in component:
            yield name, component, folder
            continue
        file = folder / component["system"]
        for inner, leaf, own_folder in _flatten_components(read_document(file).value, file.parent):
            outside = component.get("parameters", {}).items()
            given = {key.removeprefix(f"{inner}."): value for key, value in outside if key.startswith(f"{inner}.")}
            yield f"{name}.{inner}", {**leaf, "parameters": {**leaf.get("parameters", {}), **given}}, own_folder


def _call_scene_function(who: str, ask: Callable[..., Any], *values: Any, **named: Any) -> dict[str, Any]:
    try:
        answer = ask(*values, **named)
        if not isinstance(answer, dict):
            raise TypeError(f"returned {type(answer).__name__}, expected a dict")
        json.dumps(to_json_types(answer))
        return _with_defaults(answer)
    except (InputError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise ComponentError(who, "scene", f"{type(error).__name__}: {error}") from error


def _with_defaults(scene: Mapping[str, Any]) -> dict[str, Any]:
    """The scene with everything that may be left out. Raises TypeError or ValueError for what cannot be drawn."""
    if unknown := [key for key in scene if key not in (*LIST_KEYS, "water")]:
        raise ValueError(f'unknown key "{unknown[0]}"{did_you_mean(unknown[0], (*LIST_KEYS, "water"))}')
    bodies = [{**_BODY_DEFAULTS, "title": body.get("name"), **body} for body in scene.get("bodies", [])]
    for body in bodies:
        body["parts"] = [_part_with_defaults(part) for part in body["parts"]]
        if lacking := [key for key in ("name", "position") if key not in body]:
            raise ValueError(f'a body has no "{lacking[0]}"')
        if ("orientation" in body) == ("attitude" in body):
            raise ValueError(f'body "{body["name"]}" needs either "orientation" or "attitude"')
    return {**scene, "bodies": bodies, "fixed": [_part_with_defaults(part) for part in scene.get("fixed", [])]}


def _part_with_defaults(part: Mapping[str, Any]) -> dict[str, Any]:
    shape, size = str(part.get("shape")), part.get("size", ())
    if shape not in SHAPE_SIZES:
        raise ValueError(f'unknown shape "{shape}"{did_you_mean(shape, SHAPE_SIZES)}')
    if len(size) != SHAPE_SIZES[shape]:
        raise ValueError(f"a {shape} has {SHAPE_SIZES[shape]} numbers as its size, found {list(size)}")
    return {**_PART_DEFAULTS, **part}
