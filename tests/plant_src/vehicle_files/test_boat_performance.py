"""Top speed and sense of turning of vessels, computed from their data, compared with runs."""

from __future__ import annotations

import json
from typing import Any

import pytest

import cosim
from cosim.core import resources
from plant_src.catalogue import model_from_data
from plant_src.vehicle_files.summary import boat_properties, top_speed, turning_lever
from plant_src.vehicles.vessel.boat import Boat


def shipped(name: str) -> Boat:
    data = json.loads((resources.root() / f"plant_src/vehicles/data/{name}.json").read_text())
    boat = model_from_data(data, name).boat
    assert boat
    return boat


def run(name: str, speeds: list[float], stop_time: float) -> cosim.Result:
    world: dict[str, Any] = {"vehicles": {"boat": {"model": name, "position": [0, 0]}}}
    return cosim.run(
        {
            "name": name,
            "stop_time": stop_time,
            "step_size": 0.02,
            "components": {
                "plant": {"python": "cosim:plant_src/world.py:World", "arguments": world}
            },
            "connections": [],
            "events": [{"time": 0, "set": {"plant.boat.propeller_speed": speeds}}],
            "record": {"signals": ["plant.boat.velocity_body.u", "plant.boat.rates.r"]},
        }
    )


@pytest.mark.parametrize("name", ["otter_measured", "wamv16", "cybership2", "heron", "blueboat"])
def test_the_top_speed_is_that_of_a_run(name: str) -> None:
    boat = shipped(name)
    speeds = [each.max_speed if each.axis[0] > 0 else 0.0 for each in boat.propellers]
    assert run(name, speeds, 60)["plant.boat.velocity_body.u"][-1] == pytest.approx(
        top_speed(boat), rel=0.03
    )


def test_a_vessel_turns_to_the_side_of_the_lever() -> None:
    """The propellers of CyberShip II are at port, at starboard, and in a tunnel at the bow."""
    boat = shipped("cybership2")
    for i, propeller in enumerate(boat.propellers):
        speeds = [propeller.max_speed / 2 if k == i else 0.0 for k in range(3)]
        assert (
            run("cybership2", speeds, 2)["plant.boat.rates.r"][-1] * turning_lever(boat, propeller)
            > 0
        )


def test_the_properties_name_the_inputs() -> None:
    properties = dict(boat_properties(shipped("cybership2")))
    assert (
        properties["to port"]
        == "positive propeller_speed[2] (starboard), propeller_speed[3] (bow thruster)"
    )
    assert (
        properties["to starboard"]
        == "positive propeller_speed[1] (port), rudder_angle[1] (port), rudder_angle[2] (starboard)"
    )


def test_keels_turn_no_vessel() -> None:
    assert (
        dict(boat_properties(shipped("otter_measured")))["to port"]
        == "positive propeller_speed[2] (starboard)"
    )
