"""Controller for submerged vehicles: thruster speeds give the commanded force and torque."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from cosim.core import resources
from plant_src.catalogue import MODELS

SCENARIO = json.loads((resources.root() / "scenarios/rov_inspection.json").read_text())
PARAMETERS = {**SCENARIO["components"]["rov"]["parameters"], "position_reference.z": 0.0}
CRAFT = MODELS["bluerov2_heavy"].craft


def load(outputs: dict[str, Any]) -> np.ndarray:
    """Force and torque (body frame) of thrusters at the commanded speeds, from the data of the
    vehicle.
    """
    assert CRAFT is not None
    total = np.zeros(6)
    for k, thruster in enumerate(CRAFT.thrusters, 1):
        speed = outputs[f"thruster_speed[{k}]"]
        pull = thruster.thrust_coefficient * speed * abs(speed) * np.array(thruster.axis)
        total += [*pull, *np.cross(thruster.position, pull)]
    return total


def test_it_rests_without_errors(controller: Any) -> None:
    assert load(controller("submerged_controller", PARAMETERS).step({})) == pytest.approx(
        np.zeros(6), abs=1e-12
    )


@pytest.mark.parametrize(("axis", "place"), [("x", 0), ("y", 1), ("z", 2)])
def test_a_position_error_makes_a_force_along_its_axis_only(
    controller: Any, axis: str, place: int
) -> None:
    expected = np.zeros(6)
    expected[place] = 80 * 0.5 * 0.2 + 0.01 * 8 * 0.2
    found = load(
        controller("submerged_controller", PARAMETERS).step({f"position_reference.{axis}": 0.2})
    )
    assert found == pytest.approx(expected, abs=0.02)  # the shares in the scenario have four digits


def test_it_turns_to_the_heading_and_rights_itself(controller: Any) -> None:
    given = {
        "yaw_reference": 0.3,
        "vehicle.attitude.roll": 0.1,
        "vehicle.attitude.pitch": -0.2,
        "vehicle.rates.r": 0.05,
    }
    found = load(controller("submerged_controller", PARAMETERS).step(given))
    assert found[3:] == pytest.approx([-6 * 0.1, 6 * 0.2, 5 * 0.3 - 4 * 0.05], abs=0.01)


def test_forces_follow_the_heading(controller: Any) -> None:
    """The vehicle looks north: an error to the east is to its right."""
    found = load(
        controller("submerged_controller", PARAMETERS).step(
            {
                "yaw_reference": np.pi / 2,
                "vehicle.attitude.yaw": np.pi / 2,
                "position_reference.x": 0.2,
            }
        )
    )
    assert found[1] == pytest.approx(-8.0, abs=0.05)
    assert abs(found[0]) < 0.02


def test_speeds_are_limited(controller: Any) -> None:
    outputs = controller("submerged_controller", {**PARAMETERS, "velocity_P": 1e4}).step(
        {"position_reference.x": 5.0}
    )
    assert max(abs(outputs[f"thruster_speed[{k}]"]) for k in range(1, 9)) == 283.0
