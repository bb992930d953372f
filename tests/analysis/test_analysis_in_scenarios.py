"""Margins as KPIs and diagrams in the report of a scenario, and the commands."""

import json
import math

import linear_blocks
import numpy as np
import pytest
from cosim_command import run_cosim

import cosim
from cosim.analysis import figures
from cosim.core import resources

#: yaw of the quadcopter in flight
FLIGHT = {
    "extends": str(resources.root() / "scenarios/free_flight.json"),
    "name": "flight",
    "stop_time": 6,
    "kpis": [
        {
            "name": "yaw",
            "python": "cosim.analysis.kpis:margins",
            "arguments": {"components": "uav", "at": 5, "loops": ["quadcopter.attitude.yaw"]},
        }
    ],
    "checks": [
        {"kpi": "yaw.phase_margin", "min": 45},
        {"kpi": "yaw.gain_margin", "min": 6},
        {"kpi": "yaw.stable", "equals": True},
    ],
}
LOOP = {"components": "uav", "at": 5, "loops": ["quadcopter.attitude.yaw"]}
CLOSED = {
    "inputs": ["uav.altitude_command"],
    "outputs": ["quadcopter.position.z"],
    "at": 5,
    "duration": 3,
}


def figure(name, arguments):
    return {"name": name, "python": f"cosim.analysis.figures:{name}", "arguments": arguments}


def test_a_check_of_the_phase_margin_and_a_diagram_in_the_report(tmp_path):
    file = tmp_path / "flight.json"
    file.write_text(json.dumps({**FLIGHT, "figures": [figure("bode", LOOP)]}))
    done = run_cosim("run", file, "--set", "uav.altitude_command=2.5", "--json", cwd=tmp_path)
    about = json.loads(done.stdout)
    assert done.returncode == 0, done.stderr
    assert 60 < about["kpis"]["yaw.phase_margin"] < 80
    assert all(check["passed"] for check in about["checks"])
    assert (tmp_path / "runs/flight/bode.png").stat().st_size > 10_000
    assert "figure" not in done.stderr
    assert json.loads((tmp_path / "runs/flight/run.json").read_text())["parameters"] == {
        "uav.altitude_command": 2.5
    }


@pytest.mark.parametrize(("gain", "stable"), [(0.5, True), (-0.1, False)])
def test_an_unstable_loop_has_no_margins(gain, stable):
    """The loop is an integrator; a negative gain lets it grow."""
    scenario = linear_blocks.loop(gain, linear_blocks.block([[1]], [[1]], [[1]]))
    for component in scenario["components"].values():
        component["python"] = f"{linear_blocks.__file__}:StateSpace"
    arguments = {"components": "controller", "at": 0.5, "loops": ["plant.y0"]}
    evaluation = {"python": "cosim.analysis.kpis:margins", "arguments": arguments}
    result = cosim.run({**scenario, "kpis": [{"name": "loop", **evaluation}]})
    assert result.kpis["loop.stable"] is stable
    margins = [result.kpis[f"loop.{name}_margin"] for name in ("gain", "phase", "delay", "disk")]
    if stable:
        assert all(0 < margin < math.inf for margin in margins)
    else:
        assert np.isnan(margins).all()
        (note,) = result.metadata["kpi_notes"]
        assert "a loop of controller is unstable, or its linear model is not valid" in note


def test_the_figures_of_a_result_show_its_loops_and_poles():
    result = cosim.run({**FLIGHT, "kpis": [], "checks": []}, stop_time=0.1)
    (axes,) = figures.nyquist(result, **LOOP).axes
    assert axes.lines[0].get_label() == "quadcopter.attitude.yaw"
    (axes,) = figures.poles(result, **CLOSED).axes
    assert np.abs(axes.lines[-1].get_xdata()).max() < 1.01
    (axes,) = figures.steps(result, **CLOSED).axes
    times, heights = axes.lines[0].get_data()
    assert times[-1] == 3
    assert heights[-1] == pytest.approx(1, abs=0.05)


def test_a_phase_margin_that_is_too_small_fails_the_run(tmp_path):
    file = tmp_path / "flight.json"
    file.write_text(
        json.dumps({**FLIGHT, "checks": [{"kpi": "yaw.phase_margin", "min": 80}], "figures": []})
    )
    done = run_cosim("run", file, "--no-report", cwd=tmp_path)
    assert done.returncode == 3
    assert "yaw.phase_margin" in done.stdout


def test_the_margins_command_prints_a_table_and_the_estimated_response(tmp_path):
    arguments = [
        "--component",
        "uav",
        "--at",
        5,
        "--loop",
        "quadcopter.attitude.yaw",
        "--figures",
        "figures",
    ]
    done = run_cosim(
        "margins",
        "free_flight",
        *arguments,
        "--estimate",
        "chirp",
        "--amplitude",
        0.002,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    header, _, row, *_ = done.stdout.splitlines()
    assert header.split()[:3] == ["loop", "gain", "up"]
    assert row.startswith("quadcopter.attitude.yaw")
    assert "difference" in done.stdout
    assert sorted(path.name for path in (tmp_path / "figures").iterdir()) == [
        "bode.png",
        "bode.svg",
        "nyquist.png",
        "nyquist.svg",
    ]


def test_the_margins_command_gives_json_and_refuses_an_estimate_without_loop(tmp_path):
    words = ["margins", "free_flight", "--component", "uav", "--at", 5]
    done = run_cosim(*words, "--loop", "quadcopter.attitude.yaw", "--json", cwd=tmp_path)
    about = json.loads(done.stdout)
    assert (about["time"], about["step"]) == (5, 0.01)
    assert about["loops"][0]["phase"] == pytest.approx(1.22, abs=0.1)
    refused = run_cosim(
        *words, "--loop", "quadcopter.attitude", "--estimate", "sines", cwd=tmp_path
    )
    assert refused.returncode == 2
    assert "--estimate: expected one --loop and an --amplitude" in refused.stderr


def test_the_linearize_command_prints_poles_and_writes_files(tmp_path):
    names = [
        "--inputs",
        "uav.altitude_command",
        "--outputs",
        "quadcopter.position.z,quadcopter.velocity.z",
    ]
    done = run_cosim(
        "linearize",
        "free_flight",
        *names,
        "--at",
        12,
        "--duration",
        4,
        "--output",
        "m.json",
        "--figures",
        "f",
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("t = 12 s, step 0.01 s:")
    model = json.loads((tmp_path / "m.json").read_text())
    assert model["inputs"] == ["uav.altitude_command"]
    assert max(abs(complex(*pole)) for pole in model["poles"]) < 1
    assert sorted(path.name for path in (tmp_path / "f").glob("*.png")) == [
        "bode.png",
        "poles.png",
        "steps.png",
    ]
