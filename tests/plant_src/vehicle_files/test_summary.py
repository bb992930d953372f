"""Summary that `cosim new vehicle` prints: the parameters of the controller are those that shipped
scenarios set.
"""

from __future__ import annotations

import json
from typing import Any

import pytest

from cosim.core import resources
from plant_src.vehicle_files.summary import describe_vehicle, examine_vehicle


def shipped(path: str) -> Any:
    return json.loads((resources.root() / path).read_text())


@pytest.mark.parametrize("scenario", ["crazyflie_square", "survey_hexacopter"])
def test_the_parameters_are_those_of_a_shipped_scenario(scenario: str) -> None:
    components = shipped(f"scenarios/{scenario}.json")["components"]
    expected = components["uav"]["parameters"]
    vehicle = components["plant"]["arguments"]["vehicles"]["uav"]["model"]
    parameters = examine_vehicle(
        shipped(f"plant_src/vehicles/data/{vehicle}.json"), vehicle
    ).parameters
    assert len(parameters) == 9
    for key, value in parameters.items():
        assert value == pytest.approx(expected[key], rel=1e-3), key


def test_rotors_that_the_controller_cannot_fly_have_no_parameters() -> None:
    data = shipped("plant_src/vehicles/data/x500.json")
    assert examine_vehicle(data, "x500").parameters
    data["rotors"][0]["thrust_coefficient"] = 9e-6
    assert examine_vehicle(data, "x500").parameters == {}


@pytest.mark.parametrize(
    ("name", "inertia"), [("x500", [0.023845, 0.023845, 0.043919]), ("cybership2", 1.70964)]
)
def test_the_inertia_is_that_of_the_file(name: str, inertia: Any) -> None:
    assert examine_vehicle(
        shipped(f"plant_src/vehicles/data/{name}.json"), name
    ).inertia == pytest.approx(inertia, rel=1e-3)


def test_the_edges_of_the_boxes_are_those_of_the_file() -> None:
    """Products of inertia turn the principal axes of the Crazyflie, in which Bullet has its boxes,
    but not its edges.
    """
    data = shipped("plant_src/vehicles/data/crazyflie.json")
    (box,) = data["boxes"]
    properties, variables = describe_vehicle(data, "crazyflie")
    assert properties["boxes"].startswith(" x ".join(f"{edge:.4g}" for edge in box["size"]) + " m ")
    assert "rotor_speed" in [
        variable.name for variable in variables if variable.causality == "input"
    ]
