"""Stop times off the grid: the last step is shorter if the components allow it, otherwise the run
ends before it.
"""

from __future__ import annotations

import json
import math
from fractions import Fraction
from zipfile import ZipFile

import numpy as np
import pytest
from cosim_command import run_cosim
from fakes import clock, counter
from scipy.linalg import expm
from systems import endpoint, make_system, run_system

import cosim
from cosim.components.fmi import (
    FmuFile,
    InstanceSettings,
    Isolation,
    SolverSettings,
    create_component,
)
from cosim.core.errors import InputError
from cosim.core.system import Connection, Group, Iteration, System
from cosim.core.time_grid import exact_fraction
from cosim.engine import compile_plan
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.results.csv_files import read_csv

pytestmark = pytest.mark.usefixtures("executor")
ISOLATIONS = pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])


def with_fixed_steps(path, folder):
    """Return a copy of an FMU that does not allow variable steps."""
    target = folder / f"fixed_{path.name}"
    with ZipFile(path) as source, ZipFile(target, "w") as archive:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                content = content.replace(b'canHandleVariableCommunicationStepSize="true"', b"")
            archive.writestr(name, content)
    return target


@ISOLATIONS
def test_the_last_step_ends_at_the_stop_time(probe, isolation):
    """Each step of h of the lag multiplies y by 1 - h / 0.5."""
    a = create_component(FmuFile(probe), "a", isolation=isolation)
    recording = run_system(make_system({"a": a}), "0.234", "0.01", ["a.y"])
    assert recording.time.tolist() == [*(n / 100 for n in range(24)), 0.234]
    factors = [1.0, *[1 - 0.01 / 0.5] * 23, 1 - 0.004 / 0.5]
    np.testing.assert_allclose(recording.columns["a.y"], np.cumprod(factors), rtol=1e-13)


def test_an_fmu_without_variable_steps_stops_at_the_last_whole_step_and_is_named(probe, tmp_path):
    fixed = create_component(FmuFile(with_fixed_steps(probe, tmp_path)), "a")
    parts = {"a": fixed, "b": create_component(FmuFile(probe), "b")}
    plan = compile_plan(
        make_system(parts),
        Settings(*map(exact_fraction, ("0", "0.234", "0.01")), {"a.y": endpoint("a.y")}),
    )
    assert float(plan.grid.end) == 0.23
    assert plan.end_warning == (
        "the run ends at t = 0.23 s, the last whole multiple of the step size 0.01 s before the "
        "stop time 0.234 s, "
        "because a cannot make a shorter step"
    )


def test_an_fmu_with_fixed_steps_that_end_at_the_stop_time_does_not_hinder_the_others(
    probe, tmp_path
):
    """Steps of 0.02 s end at 0.1 s, those of 0.03 s do not; the last of these begins at 0.09 s."""
    parts = {"a": create_component(FmuFile(with_fixed_steps(probe, tmp_path)), "a")}
    parts["b"] = create_component(FmuFile(probe), "b")
    periods = {"a": Fraction(2, 100), "b": Fraction(3, 100)}
    recording = run_system(make_system(parts, periods=periods), "0.1", "0.01", ["a.y", "b.y"])
    assert recording.time[-1] == 0.1
    assert recording.columns["a.y"][-1] == pytest.approx(0.96**5, rel=1e-13)
    assert recording.columns["b.y"][-1] == pytest.approx(0.94**3 * 0.98, rel=1e-13)


def test_each_component_makes_its_own_last_step():
    parts = {name: counter() for name in "abc"}
    periods = {"b": exact_fraction(2), "c": exact_fraction(3)}
    steps = {name: [] for name in parts}
    for name, part in parts.items():
        part._step = lambda _, time, size, name=name: steps[name].append((time, size))
    recording = run_system(make_system(parts, periods=periods), 4.5, 1, ["a.y"])
    assert recording.time.tolist() == [0, 1, 2, 3, 4, 4.5]
    assert steps["a"] == [(0, 1), (1, 1), (2, 1), (3, 1), (4, 0.5)]
    assert steps["b"] == [(0, 2), (2, 2), (4, 0.5)]
    assert steps["c"] == [(0, 3), (3, 1.5)]


@ISOLATIONS
@pytest.mark.parametrize("method", ["rk4", "cvode"])
def test_a_linear_input_has_the_slope_of_the_shorter_step(ball, method, isolation):
    settings = InstanceSettings(None, SolverSettings(method, Fraction(1, 500)))
    parts = {"clock": clock(), "ball": create_component(FmuFile(ball), "ball", settings, isolation)}
    ramp = Connection(endpoint("clock.y"), endpoint("ball.u"), interpolation="linear")
    found = run_system(System(parts, [ramp], (("clock",), ("ball",))), "0.43", "0.1", ["ball.x"])
    assert found.time[-1] == 0.43
    assert found.columns["ball.x"][-1] == pytest.approx(0.43 - 1 + 2 * math.exp(-0.43), abs=1e-6)


def test_an_iterated_last_step_is_shorter_too(tmp_path_factory):
    """Two masses that are solved exactly for linear inputs, iterated: the error is of the order 2,
    not that of a wrong time.
    """
    from probe_fmus import build_probe_fmu

    mass = FmuFile(build_probe_fmu(2, tmp_path_factory.mktemp("mass"), name="mass"))
    parts = {name: create_component(mass, name) for name in ("one", "two")}
    wires = [
        Connection(endpoint(f"{a}.{y}"), endpoint(f"{b}.{u}"), interpolation="linear")
        for a, b in (("one", "two"), ("two", "one"))
        for y, u in ("xu", "vw")
    ]
    group = Group("g", (("one", "two"),), iteration=Iteration(1e-10, 50))
    system = System(parts, wires, ((group,),), start_values={"one": {"x_start": 1.0}})
    found = run_system(system, "0.5033", "0.005", ["one.x", "two.x"])
    matrix = np.array([[0, 1, 0, 0], [-40, -0.3, 30, 0.2], [0, 0, 0, 1], [30, 0.2, -40, -0.3]])
    expected = (expm(matrix * 0.5033) @ [1, 0, 0, 0])[[0, 2]]
    assert [column[-1] for column in found.columns.values()] == pytest.approx(expected, abs=2e-4)
    assert found.time[-1] == 0.5033


def test_a_session_that_returns_makes_whole_steps_again(probe):
    content = {
        "name": "s",
        "stop_time": 0.35,
        "step_size": 0.1,
        "components": {"a": {"fmu": str(probe)}},
    }
    with cosim.load(content) as simulation:
        simulation.step(2)
        saved = simulation.save()
        ends = []
        for _ in range(2):
            while simulation.step():
                pass
            assert simulation.time == 0.35
            ends.append(simulation.get("a.y"))
            simulation.restore(saved)
        assert ends[0] == ends[1] == pytest.approx(0.8**3 * 0.9, rel=1e-13)


def test_a_supervised_run_and_the_commands_record_the_stop_time(probe, tmp_path):
    content = {
        "name": "s",
        "stop_time": "1/3",
        "step_size": 0.1,
        "components": {"a": {"fmu": str(probe)}},
    }
    file = tmp_path / "s.json"
    file.write_text(json.dumps(content))
    assert run_cosim("run", file, "--output-dir", tmp_path / "out", "--no-report").returncode == 0
    assert read_csv(tmp_path / "out/result.csv").time.tolist() == [0, 0.1, 0.2, 0.3, 1 / 3]
    done = run_cosim(
        "simulate",
        probe,
        "--stop-time",
        "0.025",
        "--step-size",
        "0.01",
        "--output-file",
        tmp_path / "y.csv",
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "y.csv").read_text().splitlines()[-1].startswith("0.025,")
    fixed = with_fixed_steps(probe, tmp_path)
    assert (
        "cannot make a shorter step"
        in run_cosim("simulate", fixed, "--stop-time", "0.025", "--step-size", "0.01").stderr
    )


def test_a_shipped_scenario_ends_at_an_edited_stop_time():
    whole, edited = cosim.run("demo1_box", stop_time=1), cosim.run("demo1_box", stop_time=1.003)
    assert edited.time[-2:].tolist() == [1.0, 1.003]
    height, speed = edited["plant.uav.position.z"], edited["plant.uav.velocity.z"]
    assert height[:-1].tolist() == whole["plant.uav.position.z"].tolist()
    assert height[-1] - height[-2] == pytest.approx(0.003 * speed[-2:].mean(), rel=1e-2)


def test_a_duration_below_one_step_is_still_refused(probe):
    built = make_system({"a": create_component(FmuFile(probe), "a")})
    with pytest.raises(InputError, match="is shorter than the step size"):
        simulate(
            built, Settings(Fraction(0), Fraction(1, 20), Fraction(1, 10), {"a.y": endpoint("a.y")})
        )
