"""JSON Schema of the arguments of a world: keys, examples and defaults of the reader."""

from __future__ import annotations

import json
import re
from typing import Any

import jsonschema
import numpy as np
import pytest

from cosim.cli.commands.list import _schema
from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.json_reader import JsonReader
from plant_src.schemas.world import world_schema
from plant_src.world_settings import read_world_settings

SCHEMA = world_schema()
KINDS = {"World": {key: each for key, each in SCHEMA.items() if key != "$defs"}, **SCHEMA["$defs"]}
UAV = {"model": "ar_drone", "position": [0, 0, 2]}
MESH = {
    "mesh": {
        "vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "faces": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    }
}
#: place of an object of each kind, and its required or usual keys
PLACES: dict[str, tuple[tuple[str, ...], dict[str, Any]]] = {
    "World": ((), {}),
    "WorldVehicle": (("vehicles", "uav"), UAV),
    "WorldPlatform": (("platforms", "start"), {"size": [1, 1, 1], "position": [0, 0, 0]}),
    "WorldObstacle": (("obstacles", "wall"), MESH),
    "WorldEnvironment": (("environment",), {}),
    "WorldWaves": (("environment", "waves"), {"significant_height": 1, "spectrum": "jonswap"}),
    "WorldWind": (("environment", "wind"), {"speed": 3}),
    "WorldTurbulence": (("environment", "wind", "turbulence"), {"airspeed": 3}),
    "WorldWindProfile": (("environment", "wind", "profile"), {"exponent": 0.1}),
    "WorldCurrent": (("environment", "current"), {"speed": 1}),
    "WorldCurrentRamp": (("environment", "current", "ramp"), {"change": [1, 0], "duration": 1}),
    "WorldCurrentVariation": (
        ("environment", "current", "variation"),
        {"standard_deviation": 1, "time_constant": 1},
    ),
}
#: keys that stand in place of others
ALTERNATIVES = {
    "velocity": ("speed", "direction"),
    "roughness": ("exponent",),
    "intensity": ("speed_20ft",),
    "sea_state": ("waves",),
}
VESSEL_KEYS = {
    "motion": {"model": "strider", "position": [0, 0]},
    "hull": {"model": "strider", "position": [0, 0]},
}
KEYS = [(kind, key) for kind, each in KINDS.items() for key in each["properties"]]


def arguments_with(kind: str, key: str = "", value: Any = None) -> dict[str, Any]:
    """Arguments of a world that contains an object of a kind, with this key."""
    path, base = PLACES[kind]
    given = {
        name: each
        for name, each in VESSEL_KEYS.get(key, base).items()
        if name not in ALTERNATIVES.get(key, ())
    }
    arguments: dict[str, Any] = {
        "vehicles": {"uav": UAV},
        "environment": {"wind": {"speed": 3}, "current": {"speed": 1}},
    }
    parent = arguments
    for name in path[:-1]:
        parent = parent.setdefault(name, {})
    content = given | ({key: value} if key else {})
    if path:
        parent[path[-1]] = content
    else:
        arguments |= content
    return arguments


def settings_of(arguments: dict[str, Any]) -> str:
    """Text of the settings that the reader makes of arguments."""
    mesh = (
        resources.root() / "scenarios/meshes/harbour.json"
    ).read_text()  # a scenario reads the file
    found = json.loads(json.dumps(arguments).replace('"cosim:scenarios/meshes/harbour.json"', mesh))
    order = ("vehicles", "platforms", "environment", "obstacles")
    vehicles, platforms, environment, obstacles = (found.get(name, {}) for name in order)
    with np.printoptions(threshold=100_000):
        settings = read_world_settings(vehicles, platforms, environment, obstacles)
        wind = settings.environment.wind
        profile = wind.profile(7.0) if wind and wind.profile else None
        return re.sub(r" at 0x\w+", "", repr(settings)) + repr(profile)


def test_the_reader_knows_exactly_the_keys_of_the_schema(monkeypatch: pytest.MonkeyPatch) -> None:
    read: dict[tuple[str, ...], tuple[set[str], set[str]]] = {}
    original = JsonReader.read_object

    def recording(self: Any, value: Any, path: Any, required: Any, optional: Any) -> Any:
        read[path] = (set(required), {*required, *optional})
        return original(self, value, path, required, optional)

    monkeypatch.setattr(JsonReader, "read_object", recording)
    for kind in KINDS:
        settings_of(arguments_with(kind))
    for kind, (path, _) in PLACES.items():
        if path:
            assert read[path] == (set(KINDS[kind]["required"]), set(KINDS[kind]["properties"])), (
                kind
            )


@pytest.mark.parametrize(("kind", "key"), KEYS)
def test_every_key_has_a_meaning_and_an_example_that_the_reader_accepts(
    kind: str, key: str
) -> None:
    about = KINDS[kind]["properties"][key]
    assert about["description"]
    for example in about["examples"]:
        jsonschema.Draft202012Validator({"$defs": SCHEMA["$defs"], **about}).validate(example)
        settings_of(arguments_with(kind, key, example))


@pytest.mark.parametrize(
    ("kind", "key"), [each for each in KEYS if "default" in KINDS[each[0]]["properties"][each[1]]]
)
def test_a_default_is_that_of_the_reader(kind: str, key: str) -> None:
    about, without = KINDS[kind]["properties"][key], settings_of(arguments_with(kind))
    if key not in PLACES[kind][1]:
        assert settings_of(arguments_with(kind, key, about["default"])) == without
        assert settings_of(arguments_with(kind, key, about["examples"][0])) != without


def test_editors_complete_the_arguments_of_the_plant_and_of_no_other_component() -> None:
    validator = jsonschema.Draft202012Validator(_schema(None))
    scenario = {
        "name": "s",
        "stop_time": 1,
        "step_size": 0.1,
        "components": {
            "plant": {
                "python": "cosim:plant_src/world.py:World",
                "arguments": {"vehicles": {"uav": UAV}},
            }
        },
    }
    validator.validate(scenario)
    wrong = json.loads(json.dumps(scenario).replace('"position"', '"positon"'))
    assert not validator.is_valid(wrong)
    wrong["components"]["plant"]["python"] = "other.py:World"
    validator.validate(wrong)


@pytest.mark.parametrize(
    "file", sorted((resources.root() / "scenarios").glob("*.json")), ids=lambda file: file.stem
)
def test_shipped_scenarios_satisfy_the_schema(file: Any) -> None:
    jsonschema.Draft202012Validator(_schema(None)).validate(json.loads(file.read_text()))


def test_a_value_outside_of_its_limits_is_refused_by_both() -> None:
    for kind, key, value in (
        ("WorldWaves", "gamma", 8),
        ("WorldEnvironment", "sea_state", 10),
        ("WorldTurbulence", "height", 1),
    ):
        arguments = arguments_with(kind, key, value)
        assert not jsonschema.Draft202012Validator(SCHEMA).is_valid(arguments)
        with pytest.raises(InputError):
            settings_of(arguments)
