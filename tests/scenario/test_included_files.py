"""A text in "arguments" that ends in ".json" stands for the content of this file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cosim.core import resources
from cosim.core.errors import InputError
from cosim.scenario import load
from cosim.scenario.nested_systems import load_scenario

COMPONENT = """
from cosim import Component

class Echo(Component):
    variables = []
    def __init__(self, instance_name, **arguments):
        raise ValueError(repr(arguments))
"""


def scenario(folder: Path, arguments: dict[str, Any], **more: Any) -> Path:
    (folder / "echo.py").write_text(COMPONENT)
    component = {"python": "echo.py:Echo", "arguments": arguments}
    content = {
        "name": "s",
        "stop_time": 1.0,
        "step_size": 0.1,
        "components": {"echo": component},
        **more,
    }
    (file := folder / "s.json").write_text(json.dumps(content))
    return file


def arguments_of(file: Path, settings: dict[str, Any] | None = None) -> Any:
    loaded = load_scenario(file, settings)
    if loaded.problems:
        raise InputError(loaded.problems)
    return loaded.spec.components["echo"].arguments


def test_files_are_included_anywhere_in_the_arguments(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data/one.json").write_text('{"mass": 1}')
    (tmp_path / "two.json").write_text("[1, 2]")
    file = scenario(tmp_path, {"a": "data/one.json", "b": [{"c": "two.json"}], "d": "two.txt"})
    assert arguments_of(file) == {"a": {"mass": 1}, "b": [{"c": [1, 2]}], "d": "two.txt"}


def test_the_path_starts_from_the_file_that_contains_it(tmp_path: Path) -> None:
    (tmp_path / "base").mkdir()
    (tmp_path / "base/one.json").write_text('{"mass": 1, "size": 2}')
    scenario(tmp_path / "base", {"a": "one.json"})
    (file := tmp_path / "t.json").write_text(
        json.dumps(
            {
                "name": "t",
                "extends": "base/s",
                "components": {"echo": {"arguments": {"a": {"mass": 3}}}},
            }
        )
    )
    assert arguments_of(file) == {"a": {"mass": 3, "size": 2}}


def test_settings_reach_into_included_values_and_include_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "one.json").write_text('{"mass": 1}')
    file = scenario(tmp_path, {"a": "one.json"})
    assert arguments_of(file, {"/components/echo/arguments/a/mass": 5}) == {"a": {"mass": 5}}
    (tmp_path / "here").mkdir()
    (tmp_path / "here/three.json").write_text('{"mass": 3}')
    monkeypatch.chdir(tmp_path / "here")
    assert arguments_of(file, {"/components/echo/arguments/a": "three.json"}) == {"a": {"mass": 3}}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            None,
            (
                r's\.json:1:\d+: \$\.components\.echo\.arguments\.a: cannot read ".*one\.json": No '
                r"such file"
            ),
        ),
        ("{", r"one\.json:1:2: expected a key in double quotes"),
        ('{"mass": NaN}', r"one\.json:1:10: \$\.mass: NaN is not allowed"),
    ],
)
def test_a_file_that_cannot_be_included_is_named(
    text: str | None, message: str, tmp_path: Path
) -> None:
    if text is not None:
        (tmp_path / "one.json").write_text(text)
    file = scenario(tmp_path, {"a": "one.json"})
    with pytest.raises(InputError, match=message) as caught:
        arguments_of(file)
    assert len(caught.value.problems) == 1
    with pytest.raises(InputError, match=r"one\.json"):
        arguments_of(
            scenario(tmp_path, {}), {"/components/echo/arguments/a": str(tmp_path / "one.json")}
        )


def test_included_files_belong_to_the_files_of_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "one.json").write_text('{"mass": 1}')
    assert tmp_path / "one.json" in load_scenario(scenario(tmp_path, {"a": "one.json"})).files()


def test_a_problem_in_a_file_that_a_setting_names_has_its_line(tmp_path: Path) -> None:
    pointer, boat = "/components/plant/arguments/vehicles/usv/model", tmp_path / "boat.json"
    data = json.loads((resources.root() / "plant_src/vehicles/data/blueboat.json").read_text())
    boat.write_text(json.dumps({key: value for key, value in data.items() if key != "hull"}))
    with pytest.raises(InputError) as refusal:
        load("demo1_box", {pointer: str(boat)})
    assert str(refusal.value) == f'setting "{pointer}": {boat}:1:1: $: "hull" is missing'


def test_the_scene_includes_files(tmp_path: Path) -> None:
    (tmp_path / "boat.json").write_text('{"mass": 1}')
    scene = {
        "python": "cosim:plant_src/scene/replay.py:free",
        "arguments": {"vehicles": {"usv": "boat.json"}},
    }
    loaded = load_scenario(scenario(tmp_path, {}, scene=scene))
    assert loaded.spec.scene is not None
    assert loaded.spec.scene.arguments == {"vehicles": {"usv": {"mass": 1}}}
    scene["arguments"] = {"vehicles": {"usv": "ship.json"}}
    assert 'ship.json"' in str(load_scenario(scenario(tmp_path, {}, scene=scene)).problems[0])


def test_files_that_cosim_ships_have_the_same_name_in_every_installation(tmp_path: Path) -> None:
    own = tmp_path / "own.json"
    own.write_text('{"extends": "cosim:scenarios/demo1_box.json", "name": "own"}')
    run = load(own)
    run.free()
    names = set(run.files())
    assert {"own.json", "cosim:scenarios/demo1_box.json", "cosim:fmus/mixer.fmu"} <= names
    assert not [name for name in names if ".." in name]
