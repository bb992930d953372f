"""The main job: follow the vessel round the box and land on its moving deck."""

import json
import subprocess
import sys
from hashlib import sha256

import numpy as np
import pytest
from cosim_command import run_cosim

import cosim
from cosim.api import evaluate_scenario_checks
from cosim.core import resources


@pytest.fixture(scope="module")
def demo():
    with cosim.load("demo1_box") as simulation:
        return simulation.prepared, simulation.run()


def test_every_check_is_met(demo):
    assembly, result = demo
    outcomes = evaluate_scenario_checks(assembly, result)
    assert len(outcomes) == 5
    assert [outcome.check["kpi"] for outcome in outcomes if not outcome.passed] == []


def test_it_lands_well(demo):
    _, result = demo
    assert result.kpis["landing.lateral_error"] <= 0.10
    assert result.kpis["landing.touchdown_speed"] <= 0.5
    assert result.kpis["landing.bounces"] == 0
    assert result.kpis["waypoints.reached"] == 5


def test_it_stays_on_the_deck_with_its_motors_stopped(demo):
    _, result = demo
    landed = result.time > result.kpis["landing.time"] + 1
    assert result["plant.uav.contact.vessel"][landed].all()
    for i in range(1, 5):
        assert not result[f"uav.rotor_speed[{i}]"][landed].any()
    weight = 0.443892 * 9.81
    np.testing.assert_allclose(
        result["plant.uav.contact.force"][result.time > 39], weight, rtol=1e-3
    )


def test_the_last_row_is_the_stop_time_and_every_row_its_own(demo):
    _, result = demo
    assert len(result.time) == 4001
    assert result.time[-1] == 40.0
    assert np.array_equal(result.time, np.arange(4001) / 100)


def digest(tmp_path, seed):
    run = [
        sys.executable,
        "-m",
        "cosim",
        "run",
        "demo1_box",
        "--no-report",
        "--output-dir",
        str(tmp_path / seed),
    ]
    subprocess.run(
        run,
        cwd=tmp_path,
        capture_output=True,
        check=True,
        env={**__import__("os").environ, "PYTHONHASHSEED": seed},
    )
    return sha256((tmp_path / seed / "result.csv").read_bytes()).hexdigest()


def test_two_runs_give_the_same_bytes(tmp_path):
    assert digest(tmp_path, "1") == digest(tmp_path, "2")


def test_the_figures_are_drawn(tmp_path):
    assert run_cosim("run", "demo1_box", "--output-dir", tmp_path, cwd=tmp_path).returncode == 0
    for name in ("paths.png", "landing.png"):
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")


def columns(result):
    return {name: result[name] for name in result}


def test_one_controller_fmu_flies_like_the_nested_system(demo):
    _, nested = demo
    whole = {
        "fmu": str(resources.root() / "fmus/ar_drone_cascaded.fmu"),
        "parameters": {"vtol.landing_time": 5.0, "altitude_command": 2.0},
    }
    single = cosim.run("demo1_box", {"/components/uav": whole})
    for name in (
        "plant.uav.position.x",
        "plant.uav.position.z",
        "uav.altitude_reference",
        "uav.mode",
    ):
        assert np.array_equal(single[name], nested[name]), name


def test_fmi_3_flies_like_fmi_2(demo, tmp_path):
    _, second = demo
    scenario = json.loads((resources.root() / "scenarios/demo1_box.json").read_text())
    system = json.loads((resources.root() / "scenarios/systems/ar_drone_cascaded.json").read_text())
    fmi3 = resources.root() / "fmus/fmi3"
    for component in system["components"].values():
        component["fmu"] = str(fmi3 / component["fmu"].rpartition("/")[2])
    (tmp_path / "system.json").write_text(json.dumps(system))
    changes = {
        "/components/uav/system": str(tmp_path / "system.json"),
        "/components/usv/fmu": str(fmi3 / scenario["components"]["usv"]["fmu"].rpartition("/")[2]),
    }
    third = cosim.run("demo1_box", changes)
    assert sorted(third) == sorted(second)
    for name in second:
        assert np.array_equal(third[name], second[name]), name
