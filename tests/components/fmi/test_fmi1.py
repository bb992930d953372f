"""FMI 1.0 Co-Simulation, with an FMU of our own (the tests of Model Exchange cover its other
interface).
"""

from __future__ import annotations

from fractions import Fraction

import pytest
from ball_fmus import build_ball_fmu
from cosim_command import run_cosim
from systems import endpoint, make_system, run_system

from cosim.components.fmi import FmuFile, Isolation, create_component
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

pytestmark = pytest.mark.usefixtures("executor")


@pytest.fixture(scope="session")
def slave(tmp_path_factory):
    return build_ball_fmu(1, tmp_path_factory.mktemp("slave"), "CS")


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
def test_a_slave_makes_its_steps(slave, isolation):
    component = create_component(FmuFile(slave), "ball", isolation=isolation)
    built = make_system({"ball": component}, start_values={"ball": {"u": 2.0}})
    recording = run_system(built, 1, "0.1", ["ball.x", "ball.minus_x", "ball.count"])
    x = [1.0]
    for _ in range(10):
        x.append(x[-1] + 0.1 * (2.0 - x[-1]))
    assert recording.columns["ball.x"].tolist() == x
    assert recording.columns["ball.minus_x"].tolist() == [-value for value in x]
    assert recording.columns["ball.count"].tolist()[-1] == 4


def test_a_discarded_step_names_the_time_that_was_reached(slave):
    built = make_system(
        {"ball": create_component(FmuFile(slave), "ball")}, start_values={"ball": {"fault": 6}}
    )
    outcome = simulate(
        built, Settings(Fraction(0), Fraction(1), Fraction(1, 10), {"ball.x": endpoint("ball.x")})
    )
    expected = (
        "ball: fmi1DoStep failed at t = 0.6 s: status 2 (discard); lastSuccessfulTime is 0.6 s"
    )
    assert (str(outcome.failure), len(outcome.recording.time)) == (expected, 7)


def test_all_commands_accept_the_fmu(slave):
    assert "FMI version   1.0 Co-Simulation" in run_cosim("info", slave).stdout
    done = run_cosim("simulate", slave)
    assert (done.returncode, done.stderr) == (0, "")
    validated = run_cosim("validate", slave).stdout.splitlines()
    assert [line for line in validated if "unused-functions" not in line] == []
