"""The C controller against its control law in NumPy, and in place of the shipped autopilot."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.validation import validate_fmu

import cosim
from cosim.core import resources

ROOT = resources.root()
FMU = ROOT / "fmus/c/speed_keeper.fmu"
STEP = 0.01
PARAMETERS = {
    "speed_command": 1.3,
    "speed_P": 4.0,
    "speed_I": 2.5,
    "thrust_limit": 2.0,
    "course_command": -2.5,
    "course_P": 0.9,
    "course_D": 0.4,
    "rudder_limit": 0.5,
}


@pytest.fixture
def keeper(controller):
    return controller("c/speed_keeper", PARAMETERS)


@pytest.fixture
def measured():
    """Random walks over 10 s: yaw crosses +-pi, the speed error changes its sign, both outputs come
    to their limits.
    """
    steps = np.random.default_rng(4).normal(0, [[0.3], [0.05], [0.05]], (3, 1000))
    yaw, speed, rate = np.cumsum(steps, axis=1)
    return {
        "vehicle.attitude.yaw": yaw,
        "vehicle.velocity_body.u": 1 + speed,
        "vehicle.rates.r": rate,
    }


def stepped(keeper, measured):
    """Outputs of all steps by name."""
    rows = [
        keeper.step(dict(zip(measured, values, strict=True)))
        for values in zip(*measured.values(), strict=True)
    ]
    values = np.array([list(row.values()) for row in rows]).T
    return dict(zip(rows[0], values, strict=True))


def expected_thrust(error):
    """PI control whose integral is held at the limit, step by step."""
    integral, out = 0.0, []
    for e in error:
        demand = PARAMETERS["speed_P"] * e + integral
        out.append(np.clip(demand, -PARAMETERS["thrust_limit"], PARAMETERS["thrust_limit"]))
        integral += PARAMETERS["speed_I"] * STEP * e * (abs(demand) < PARAMETERS["thrust_limit"])
    return np.array(out)


def test_thrust_is_that_of_a_pi_controller_with_a_limit(keeper, measured):
    thrust = stepped(keeper, measured)["thrust"]
    expected = expected_thrust(PARAMETERS["speed_command"] - measured["vehicle.velocity_body.u"])
    assert thrust == pytest.approx(expected, abs=1e-12)
    limited = np.abs(thrust) == PARAMETERS["thrust_limit"]
    assert 100 < limited.sum() < 900


def test_rudder_takes_the_short_way_to_the_course(keeper, measured):
    rudder = stepped(keeper, measured)["rudder_angle"]
    error = np.angle(np.exp(1j * (measured["vehicle.attitude.yaw"] - PARAMETERS["course_command"])))
    demand = PARAMETERS["course_P"] * error + PARAMETERS["course_D"] * measured["vehicle.rates.r"]
    assert rudder == pytest.approx(np.clip(demand, -0.5, 0.5), abs=1e-12)
    assert (np.abs(rudder) < 0.5).any()
    assert (np.abs(rudder) == 0.5).any()


def test_a_restored_state_repeats_the_future(keeper, measured):
    keeper.step({name: values[0] for name, values in measured.items()})
    state = keeper.fmu.getFMUState()
    first = stepped(keeper, measured)
    keeper.fmu.setFMUState(state)
    again = stepped(keeper, measured)
    keeper.fmu.freeFMUState(state)
    assert all(np.array_equal(first[name], again[name]) for name in first)


def test_outputs_follow_inputs_in_initialization_mode(controller):
    keeper = controller("c/speed_keeper", PARAMETERS)
    keeper.fmu.reset()
    keeper.fmu.setupExperiment(startTime=0.0)
    keeper.fmu.enterInitializationMode()
    keeper.set({"vehicle.velocity_body.u": 0.99})
    assert keeper.get("thrust") == pytest.approx(82.65 * 0.01)


def test_it_validates_without_problems():
    assert validate_fmu(str(FMU)) == []


def test_it_replaces_the_autopilot_of_demo_1():
    usv = {"fmu": str(FMU), "parameters": {"speed_command": 0.8, "course_command": 0.5}}
    result = cosim.run("demo1_box", parameters={"/components/usv": usv})
    assert result.kpis["landing.landed_at_end"]
    assert result["plant.usv.velocity_body.u"][-1] == pytest.approx(0.8, abs=1e-3)
    assert result["plant.usv.attitude.yaw"][-1] == pytest.approx(0.5, abs=1e-3)
