"""Systems of many components: work that is done only once, and the timing of a run."""

import json

from idle_folders import remove_idle_folders

import cosim
from cosim.components.fmi import api, file


def ring(folder, probe, size):
    """Write a scenario of `size` instances of one FMU in a ring."""
    names = [f"p{i}" for i in range(size)]
    scenario = folder / "ring.json"
    document = {
        "name": "ring",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": {name: {"fmu": str(probe)} for name in names},
        "connections": [
            {"from": f"{a}.y", "to": f"{b}.u"}
            for a, b in zip(names, names[1:] + names[:1], strict=True)
        ],
        "algorithm": {"stages": [names]},
    }
    scenario.write_text(json.dumps(document))
    return scenario


def test_one_file_is_extracted_and_loaded_once(tmp_path, probe, monkeypatch):
    remove_idle_folders()
    extracted, loaded = [], []
    extract, load_library = file.extract, api.load_library
    monkeypatch.setattr(file, "extract", lambda *args: extracted.append(args) or extract(*args))
    monkeypatch.setattr(
        api, "load_library", lambda *args: loaded.append(args) or load_library(*args)
    )
    result = cosim.run(ring(tmp_path, probe, 20))
    assert (len(extracted), len(loaded)) == (1, 1)
    assert all(result[f"p{i}.y"][-1] == 1.0 for i in range(20))


def test_instances_of_one_library_keep_their_names_and_values(tmp_path, probe):
    scenario = ring(tmp_path, probe, 3)
    document = json.loads(scenario.read_text())
    for i, component in enumerate(document["components"].values()):
        component["parameters"] = {"y_start": float(i)}
    scenario.write_text(json.dumps(document | {"connections": []}))
    result = cosim.run(scenario, {"p1.u": 5.0})
    assert [result[f"p{i}.y"][0] for i in range(3)] == [0.0, 1.0, 2.0]
    assert result["p1.y"][1] == 1.0 + 0.01 * (5.0 - 1.0) / 0.5


def test_the_timing_of_a_run_has_all_its_parts(tmp_path, probe):
    timing = cosim.run(ring(tmp_path, probe, 2)).timing
    parts = {
        "parse_seconds",
        "create_seconds",
        "wiring_seconds",
        "initialize_seconds",
        "loop_seconds",
    }
    assert set(timing) >= parts
    simulated = ("instantiate_seconds", "initialize_seconds", "loop_seconds")
    assert timing["simulate_seconds"] == sum(timing[part] for part in simulated)
    assert (
        0
        < sum(timing[part] for part in parts)
        <= timing["load_seconds"] + timing["simulate_seconds"]
    )
