"""What to draw in the 3-D replay, asked from the components of a scenario: the importer itself knows no vehicle.

A Python component may say what it looks like by a static method `scene(name, scenario) -> dict`; a scenario of other components
names a function `(scenario, **arguments) -> dict` under its key "scene". `name` is the component's, `scenario` the scenario as
JSON, where "components" holds those of nested systems by their full names. The answer is JSON as well, with any of these keys
(m, rad, world frame z up; colours as CSS has them):

- `bodies`: {"name", "title", "colour", "position": [x, y, z], "orientation": [w, x, y, z] or "attitude": [roll, pitch, yaw],
  "parts"}; position, orientation and attitude are names of signals, their negatives ("-name"), or numbers
- `parts` of a body, and `fixed`: {"shape", "size", "position", "orientation": [x, y, z, w], "colour": [r, g, b] in 0 ... 1,
  "opacity"}; a "box" has its edges as size, a "cylinder" (along z) radius and length, a "cone" lower and upper radius and length,
  a "sphere" its radius, a "ring" radius and thickness
- `water`: {"waves": [{"amplitude", "frequency", "number", "direction", "phase"}], "gain": signal or number}; it lies at z = 0
- `markers`: {"position", "radius", "label"}; `views`: {"name", "on": a body, "eye", "target"} in axes that turn with its yaw
- `spans`: {"signal", "label", "colour"}, a Boolean; `plots`: lists of patterns of signals
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from inspect import getattr_static
from pathlib import Path
from typing import Any

from ..errors import ComponentError, InputError
from ..python_component import load_object
from ..results.files import plain
from ..scenario.document import read_document
from ..scenario.functions import load_function

LISTS = ("bodies", "fixed", "markers", "views", "spans", "plots")


def scene_of(metadata: Mapping[str, Any]) -> dict[str, Any]:
    """The scene of a run, given what its run.json says; nothing to draw when no component says what it looks like.

    Raises InputError when something that the scenario names is not there, ComponentError when asking fails.
    """
    scene: dict[str, Any] = {**{key: [] for key in LISTS}, "water": None}
    if "scenario_file" not in metadata:
        return scene
    for part in _parts(metadata["scenario"], Path(metadata["scenario_file"]).parent):
        for key in LISTS:
            scene[key] += part.get(key, [])
        scene["water"] = scene["water"] or part.get("water")
    return scene


def _parts(scenario: Mapping[str, Any], folder: Path) -> Iterator[dict[str, Any]]:
    leaves = list(_leaves(scenario, folder))
    flat = {**scenario, "components": {name: component for name, component, _ in leaves}}
    for name, component, own_folder in leaves:
        if isinstance(reference := component.get("python"), str):
            ask = getattr_static(load_object(reference, own_folder), "scene", None)
            if isinstance(ask, staticmethod):
                yield _answer(f'component "{name}"', ask, name, flat)
    if spec := scenario.get("scene"):
        yield _answer("the scenario's scene", load_function(spec["python"], folder), flat, **spec.get("arguments", {}))


def _leaves(system: Mapping[str, Any], folder: Path) -> Iterator[tuple[str, dict[str, Any], Path]]:
    """(full name, component, where its paths start) of all components, those of nested systems instead of these.

    Parameters that are set from outside ("usv.waypoint_x") reach the components inside.
    """
    for name, component in system.get("components", {}).items():
        if "system" not in component:
            yield name, component, folder
            continue
        file = folder / component["system"]
        for inner, leaf, own_folder in _leaves(read_document(file).value, file.parent):
            outside = component.get("parameters", {}).items()
            given = {key.removeprefix(f"{inner}."): value for key, value in outside if key.startswith(f"{inner}.")}
            yield f"{name}.{inner}", {**leaf, "parameters": {**leaf.get("parameters", {}), **given}}, own_folder


def _answer(who: str, ask: Callable[..., Any], *values: Any, **named: Any) -> dict[str, Any]:
    try:
        answer = ask(*values, **named)
        json.dumps(plain(answer))
    except InputError:
        raise
    except Exception as error:
        raise ComponentError(who, "scene", f"{type(error).__name__}: {error}") from error
    if not isinstance(answer, dict):
        raise ComponentError(who, "scene", f"returned {type(answer).__name__}, expected a dict")
    return answer
