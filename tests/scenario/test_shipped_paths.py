"""Paths that begin with "cosim:" start from the files that cosim ships, wherever a scenario is."""

import json

import pytest

import cosim
from cosim.scenario import load

PLANT = {
    "python": "cosim:plant_src/world.py:World",
    "arguments": {"vehicles": {"uav": {"model": "ar_drone", "position": [0, 0, 1]}}},
}
VESSEL = {"fmu": "cosim:fmus/strider.fmu"}


def document(**components):
    return {"name": "away", "stop_time": 0.05, "step_size": 0.01, "components": components}


def test_a_scenario_of_any_folder_uses_shipped_components(tmp_path):
    file = tmp_path / "away.json"
    file.write_text(json.dumps(document(plant=PLANT, vessel=VESSEL)))
    assert {"plant.uav.position.z", "vessel.position.x"} <= set(cosim.run(file))
    below = tmp_path / "below"
    below.mkdir()
    (below / "more.json").write_text(json.dumps({"extends": "../away", "name": "more"}))
    assert "vessel.position.x" in cosim.run(below / "more.json")


def test_dictionaries_and_settings_name_shipped_files():
    both = document(plant=PLANT, vessel=VESSEL)
    assert "vessel.deck.position.x" in cosim.run(both)
    inputs = {"signals": ["vessel.propeller_speed[1]"]}  # of the Otter, the Strider has a rudder
    changed = cosim.run(both, {"/components/vessel/fmu": "cosim:fmus/otter.fmu", "/record": inputs})
    assert list(changed) == inputs["signals"]


def test_shipped_files_that_do_not_exist_are_refused():
    with pytest.raises(cosim.InputError, match=r'fmus/strder.fmu" does not exist'):
        cosim.run(document(vessel={"fmu": "cosim:fmus/strder.fmu"}))


def test_a_shipped_nested_system_is_extended(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    changed = {
        "altitude": {
            "fmu": "cosim:fmus/altitude_controller.fmu",
            "parameters": {"altitude_P": 100.0},
        }
    }
    system = {"extends": "cosim:scenarios/systems/ar_drone_cascaded.json", "components": changed}
    (tmp_path / "control.json").write_text(json.dumps(system))
    scenario = {
        "extends": "demo1_box",
        "name": "own",
        "components": {"uav": {"system": "control.json"}},
        "stop_time": 0.1,
    }
    (tmp_path / "own.json").write_text(json.dumps(scenario))
    with cosim.load("own") as simulation:  # a file of the working directory, without ".json"
        assert simulation.get("uav.altitude.altitude_P") == 100.0


def test_the_sources_of_components_have_the_names_of_the_user(tmp_path):
    (tmp_path / "own.py").write_text(
        "from pythonfmu import Fmi2Slave\n\n\nclass Own(Fmi2Slave):\n    def do_step(self, time, "
        "step):\n        return True\n"
    )
    components = {
        "a": {"fmu": "cosim:fmus/mixer.fmu"},
        "b": {"python": "cosim:controllers/python/mixer.py:Mixer"},
        "c": {"python": "own.py:Own"},
    }
    file = tmp_path / "mixers.json"
    file.write_text(
        json.dumps({"name": "mixers", "stop_time": 1, "step_size": 0.01, "components": components})
    )
    prepared = load(file)
    prepared.free()
    assert prepared.sources == {
        name: component.get("fmu") or component["python"] for name, component in components.items()
    }
