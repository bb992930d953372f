"""Inputs and parameters are recorded beside outputs, in the plant, in sensors and in FMUs, by both
executors.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import cosim
from cosim.core import resources

ROOT = resources.root()
VEHICLES = {
    "uav": {"model": "ar_drone", "position": [0, 0, 5]},
    "usv": {"model": "strider", "position": [3, 0], "velocity_body": [1, 0, 0]},
}
SPEEDS = [350.0, 351.0, 352.0, 353.0]


def scenario(recorded: list[str], **components: Any) -> dict[str, Any]:
    return {
        "name": "recorded",
        "stop_time": 0.05,
        "step_size": 0.01,
        "components": {
            "plant": {
                "python": f"{ROOT}/plant_src/world.py:World",
                "arguments": {"vehicles": VEHICLES},
            },
            **components,
        },
        "record": {"signals": recorded},
    }


def run(document: dict[str, Any], **inputs: Any) -> cosim.Result:
    with cosim.load(document) as simulation:
        for name, value in inputs.items():
            simulation.set(name.replace("__", "."), value)
        while simulation.step():
            pass
        return simulation.result


@pytest.mark.usefixtures("executor")
def test_inputs_and_parameters_of_the_plant_leave_its_outputs_in_place() -> None:
    outputs = ["plant.uav.position.*", "plant.usv.*", "plant.usv.contact.*"]
    others = [
        "plant.uav.mass",
        "plant.uav.rotor_speed*",
        "plant.usv.thrust",
        "plant.usv.rudder_angle",
    ]
    inputs = {
        "plant__uav__rotor_speed": SPEEDS,
        "plant__usv__thrust": 3.0,
        "plant__usv__rudder_angle": 0.2,
    }
    plain, recorded = (run(scenario(names), **inputs) for names in (outputs, outputs + others))
    for name in plain.signals():
        assert np.array_equal(plain[name], recorded[name]), name
    assert set(recorded["plant.uav.mass"]) == {0.443892}
    for i, speed in enumerate(SPEEDS, 1):
        assert recorded[f"plant.uav.rotor_speed[{i}]"].tolist()[1:] == [speed] * 5
    assert recorded["plant.usv.thrust"].tolist()[1:] == [3.0] * 5
    assert recorded["plant.usv.rudder_angle"].tolist()[1:] == [0.2] * 5


@pytest.mark.usefixtures("executor")
def test_inputs_of_a_sensor_and_of_an_fmu_are_recorded() -> None:
    components = {
        "gnss": {"python": f"{ROOT}/plant_src/sensors/gnss.py:Gnss", "parameters": {"seed": 3}},
        "speed": {"fmu": f"{ROOT}/fmus/speed_controller.fmu"},
    }
    connection = {"from": "plant.usv.velocity_body.u", "to": "speed.vehicle.velocity_body.u"}
    outputs = ["plant.usv.velocity_body.u", "gnss.*", "speed.*"]
    others = [
        "gnss.seed",
        "gnss.vehicle.position.x",
        "speed.vehicle.velocity_body.u",
        "speed.speed_reference",
    ]
    inputs = {"gnss__vehicle__position__x": 7.0, "speed__speed_reference": 1.5}
    plain, recorded = (
        run({**scenario(names, **components), "connections": [connection]}, **inputs)
        for names in (outputs, outputs + others)
    )
    for name in plain.signals():
        assert np.array_equal(plain[name], recorded[name]), name
    assert set(recorded["gnss.seed"]) == {3.0}
    assert recorded["gnss.vehicle.position.x"].tolist()[1:] == [7.0] * 5
    assert recorded["speed.speed_reference"].tolist()[1:] == [1.5] * 5
    sent = recorded["plant.usv.velocity_body.u"]  # the plant is in an earlier stage
    assert np.array_equal(recorded["speed.vehicle.velocity_body.u"][1:], sent[1:])
