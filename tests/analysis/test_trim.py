"""Operating points."""

import json
from pathlib import Path

import numpy as np
import pytest
from cosim_command import run_cosim
from linear_blocks import block, loop

import cosim

HOVER = Path(__file__).with_name("hover.json")


def plant(**more):
    """Return a scenario with x[k+1] = 0.5 x + u0 + 2 u1, y = x, which starts at x = 1."""
    return {
        "name": "s",
        "stop_time": 1,
        "step_size": 0.5,
        "components": {"plant": block([[0.5]], [[1, 2]], [[1]], x0=[1.0], **more)},
    }


def test_the_input_that_holds_a_state_is_found():
    """At x = 1, 0.5 = u0 + 2 u1 keeps the state, and the point with the smallest change of the
    inputs is not required.
    """
    found = cosim.trim(plant(), ["plant.u0"], ["plant.y0"], parameters={"plant.u1": 0.1})
    assert found.is_found
    assert found.parameters["plant.u0"] == pytest.approx(0.3)
    assert found.residuals == {"plant.y0": pytest.approx(0, abs=1e-9)}


def test_initial_states_are_found_by_json_pointers():
    pointer = "/components/plant/arguments/x0/0"
    found = cosim.trim(plant(), [pointer, "plant.u0"], ["plant.y0"], {"plant.y0": 4.0})
    assert found.parameters == {pointer: pytest.approx(4), "plant.u0": pytest.approx(2)}


def test_contradictory_requirements_are_no_equilibrium():
    found = cosim.trim(plant(), ["plant.u0"], ["plant.y0"], {"plant.y0": 4.0})
    assert not found.is_found
    assert found.largest == "plant.y0"
    assert found.evaluations < 100


def test_a_climb_at_constant_speed_is_trimmed_by_initial_speed_and_rotors():
    free = ["quadcopter.rotor_speed", "quadcopter.initial.velocity_body.w"]
    found = cosim.trim(
        HOVER, free, ["quadcopter.velocity", "quadcopter.rates"], {"quadcopter.velocity.z": 0.5}
    )
    assert found.is_found
    assert found.parameters["quadcopter.initial.velocity_body.w"] == pytest.approx(0.5)
    with cosim.load(HOVER, found.parameters, stop_time=2) as simulation:
        simulation.run()
        assert simulation.get("quadcopter.position.z") == pytest.approx(3.0, abs=1e-9)


def test_the_shipped_example_hovers():
    """The rotor speeds in the file are those that the command of docs/analysis.md finds."""
    result = cosim.run(HOVER, stop_time=1)
    assert np.abs(result["quadcopter.position.z"] - 2).max() < 1e-9
    assert np.abs(result["quadcopter.attitude.pitch"]).max() < 1e-9


def test_wrong_names_are_refused():
    for arguments, message in (
        ((["plant.u7"], ["plant.y0"]), 'no variable "u7"'),
        (
            (["/components/plant/arguments/x1"], ["plant.y0"]),
            'the scenario has no "/components/plant/arguments/x1"',
        ),
        (([], ["plant.y0"]), "expected at least one free value"),
    ):
        with pytest.raises(cosim.InputError, match=message):
            cosim.trim(plant(), *arguments)


def test_an_input_that_a_connection_feeds_is_refused():
    scenario = loop(0.5, block([[0.5]], [[1]], [[1]], x0=[1.0]))
    with pytest.raises(
        cosim.InputError,
        match=r'free: "plant.u0" is fed by "controller.y0", expected an input without connection',
    ):
        cosim.trim(scenario, ["plant.u0"], ["plant.y0"])


def test_a_free_value_that_changes_no_residual_is_named():
    scenario = plant()
    scenario["components"]["other"] = block([[0.5]], [[1]], [[1]])
    found = cosim.trim(scenario, ["plant.u0", "other.u0"], ["plant.y0"])
    assert found.is_found
    assert found.without_effect == ["other.u0"]


def test_the_command_writes_a_scenario_that_extends_the_given_one(tmp_path):
    file = tmp_path / "trimmed.json"
    equal = ["--set", "quadcopter.rotor_speed=[340, 340, 340, 340]"]
    arguments = [
        "--free",
        "quadcopter.rotor_speed",
        "--steady",
        "quadcopter.velocity,quadcopter.rates",
    ]
    done = run_cosim("trim", str(HOVER), *equal, *arguments, "--output", str(file), "--json")
    about = json.loads(done.stdout)
    assert about["found"] is True
    written = json.loads(file.read_text())
    speeds = written["components"]["quadcopter"]["parameters"]["rotor_speed"]
    assert speeds == about["parameters"]["quadcopter.rotor_speed"]
    assert cosim.run(file)["quadcopter.position.z"][-1] == pytest.approx(2.0, abs=1e-9)
