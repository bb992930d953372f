"""Scenes of components and scenarios."""

import json
import shutil
from pathlib import Path

import pytest

from cosim.core.errors import ComponentError, InputError
from cosim.core.resources import root
from cosim.report.scene import build_scene
from cosim.scenario import load
from cosim.scenario.extension import read_system_document

SHIPPED = sorted((root() / "scenarios").glob("*.json"))


def scene(file):
    return build_scene(
        {"scenario": read_system_document(Path(file)).value, "scenario_file": str(file)}
    )


@pytest.mark.parametrize("file", SHIPPED, ids=lambda file: file.stem)
def test_every_shipped_scenario_has_vehicles_to_show(file):
    found = scene(file)
    assert found["bodies"], 'scenarios on plant FMUs alone need a "scene"'
    assert found["plots"]
    for body in found["bodies"]:
        assert len(body["position"]) == 3
        assert body["parts"]
    assert json.loads(json.dumps(found)) is not None


def test_signals_of_the_scene_are_recorded(flight_result):
    found = build_scene(flight_result.metadata)
    for body in found["bodies"]:
        assert all(name in flight_result for name in (*body["position"], *body["orientation"]))
    assert all(span["signal"] in flight_result for span in found["spans"])
    for patterns in found["plots"]:
        assert any(flight_result.signals(pattern) for pattern in patterns)


def test_demo_1_has_its_waypoints_and_platforms():
    found = scene(root() / "scenarios/demo1_box.json")
    assert [marker["label"] for marker in found["markers"]] == ["1", "2", "3", "4", "5"]
    assert found["markers"][1] == {"position": (10 / 3, -10 / 3, 0.0), "radius": 0.5, "label": "2"}
    planks = [part for part in found["fixed"] if part["shape"] == "box"]
    lengths = [part["size"][0] for part in planks]
    assert set(lengths) == {5.0}
    assert {part["position"][2] for part in planks} == {0.45}


@pytest.mark.parametrize(("boat", "hull_parts"), [("heron", 11), ("cybership2", 2)])
def test_a_boat_has_a_landing_mark_of_five_parts_only_beside_a_multirotor(boat, hull_parts):
    def part_counts(*models):
        vehicles = {model: {"model": model, "position": [0, 0]} for model in models}
        plant = {"python": "../plant_src/world.py:World", "arguments": {"vehicles": vehicles}}
        found = build_scene(
            {
                "scenario": {"components": {"plant": plant}},
                "scenario_file": str(root() / "scenarios/boat.json"),
            }
        )
        return {body["title"]: len(body["parts"]) for body in found["bodies"]}

    assert part_counts(boat) == {boat: hull_parts}
    assert part_counts(boat, "crazyflie")[boat] == hull_parts + 5


def test_a_world_inside_a_nested_system_is_found_by_its_full_name():
    found = scene(root() / "scenarios/performance_1.json")
    assert [body["position"][0] for body in found["bodies"]] == [
        "demo1.plant.uav.position.x",
        "demo1.plant.usv.position.x",
    ]
    assert len(found["markers"]) == 5


def test_angles_of_the_published_simulator_are_converted():
    body = scene(root() / "scenarios/demo1_replica.json")["bodies"][0]
    assert body["attitude"] == [
        "plant.uav.attitude.phi",
        "-plant.uav.attitude.theta",
        "-plant.uav.attitude.psi",
    ]


LAMP = """
class Lamp:
    @staticmethod
    def scene(name, scenario):
        return {answer}

def night(scenario, bodies):
    return {{"bodies": bodies, "water": None}}
"""


LIT = (
    "{'bodies': [{'name': name, 'position': [0, 0, 'a.z'], 'attitude': [0, 0, 0], 'parts': "
    "[{'shape': 'sphere', 'size': [1]}]}]}"
)


def lamp(folder, answer=LIT, **scenario):
    (folder / "lamp.py").write_text(LAMP.format(answer=answer))
    components = {"a": {"python": "lamp.py:Lamp"}, "b": {"fmu": "b.fmu"}}
    return {
        "scenario": {"components": components, **scenario},
        "scenario_file": str(folder / "s.json"),
    }


def test_components_and_the_scenario_may_have_scenes(tmp_path):
    more = {
        "python": "lamp.py:night",
        "arguments": {
            "bodies": [{"name": "moon", "position": [0, 0, 9], "orientation": [1, 0, 0, 0]}]
        },
    }
    found = build_scene(lamp(tmp_path, scene=more))["bodies"]
    assert [body["title"] for body in found] == ["a", "moon"]
    assert found[0]["parts"][0]["opacity"] == 1


def test_a_method_scene_that_is_not_static_is_ignored(tmp_path):
    about = lamp(tmp_path)
    (tmp_path / "lamp.py").write_text(
        "class Lamp:\n    def scene(self):\n        return 'backstage'\n"
    )
    assert build_scene(about)["bodies"] == []


def test_without_scene_or_scenario_there_is_nothing_to_draw(tmp_path):
    shutil.copy(root() / "controllers/python/course_keeper.py", tmp_path)
    components = {"keeper": {"python": "course_keeper.py:CourseKeeper"}}
    assert (
        build_scene(
            {"scenario": {"components": components}, "scenario_file": str(tmp_path / "s.json")}
        )["bodies"]
        == []
    )
    assert build_scene({})["water"] is None


WRONG = {
    "1 / 0": 'component "a".*ZeroDivisionError',
    "exit('no lamp')": 'component "a".*SystemExit: no lamp',
    "[]": "list, expected a dict",
    "{'bodies': [object()]}": "not JSON serializable",
    "{'body': []}": 'unknown key "body"; did you mean "bodies"',
    "{'fixed': [{'shape': 'bax', 'size': [1, 1, 1]}]}": 'unknown shape "bax"; did you mean "box"',
    "{'fixed': [{'shape': 'box', 'size': [1]}]}": r"a box has 3 numbers as its size, found \[1\]",
    "{'bodies': [{'name': 'b'}]}": 'a body has no "position"',
    (
        "{'bodies': [{'name': 'b', 'position': [0, 0, 0]}]}"
    ): 'body "b" needs either "orientation" or "attitude"',
}


@pytest.mark.parametrize(("answer", "message"), WRONG.items())
def test_an_invalid_scene_is_an_error_that_names_the_component(tmp_path, answer, message):
    with pytest.raises(ComponentError, match=message):
        build_scene(lamp(tmp_path, answer))


def test_a_scene_function_with_a_mistake_is_refused_before_the_run(tmp_path):
    scenario = json.loads((root() / "scenarios/free_flight.json").read_text())
    scenario["scene"]["arguments"] = {"vehicle": {}}
    for component in scenario["components"].values():
        component["fmu"] = str(root() / "fmus" / Path(component["fmu"]).name)
    scenario["scene"]["python"] = f"{root()}/plant_src/scene/replay.py:free"
    (tmp_path / "flight.json").write_text(json.dumps(scenario))
    with pytest.raises(
        InputError, match=r'scene: "free" takes no argument "vehicle"; did you mean "vehicles"'
    ):
        load(tmp_path / "flight.json")


def test_a_missing_file_is_named(tmp_path):
    about = lamp(tmp_path)
    (tmp_path / "lamp.py").unlink()
    with pytest.raises(InputError, match=r'file "lamp.py" does not exist'):
        build_scene(about)
