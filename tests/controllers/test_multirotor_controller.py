"""Controller for multirotors of any layout: rotor speeds give the commanded thrust and torque."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

GRAVITY = 9.81
ANGLES = np.deg2rad([30, 90, 150, 210, 270, 330])
LAYOUTS = {
    "plus": {"x": [0.18, 0, -0.18, 0], "y": [0, 0.18, 0, -0.18], "sense": [1, -1, 1, -1]},
    "cross": {"x": [0.1, -0.1, -0.1, 0.1], "y": [-0.1, -0.1, 0.1, 0.1], "sense": [-1, 1, -1, 1]},
    "hexagon": {
        "x": list(0.34 * np.cos(ANGLES)),
        "y": list(0.34 * np.sin(ANGLES)),
        "sense": [1, -1, 1, -1, 1, -1],
    },
}
MASS, INERTIA, THRUST, TORQUE = 1.5, [0.02, 0.03, 0.05], 1e-5, 2e-7


def parameters(layout: dict[str, list[float]]) -> dict[str, Any]:
    padded = {
        f"rotor_{key}": [*values, *[0.0] * (8 - len(values))] for key, values in layout.items()
    }
    numbers = {
        "mass": MASS,
        "inertia": INERTIA,
        "thrust_coefficient": THRUST,
        "torque_coefficient": TORQUE,
    }
    return {**padded, **numbers, "rotor_count": len(layout["x"]), "rotor_speed_max": 2000.0}


def loads(layout: dict[str, list[float]], outputs: dict[str, Any]) -> np.ndarray:
    """Thrust and torques about x, y and z that rotors at the commanded speeds make."""
    squared = np.array([outputs[f"rotor_speed[{k}]"] for k in range(1, len(layout["x"]) + 1)]) ** 2
    x, y, sense = (np.array(layout[key]) for key in ("x", "y", "sense"))
    return np.array(
        [
            THRUST * squared.sum(),
            THRUST * squared @ y,
            -THRUST * squared @ x,
            TORQUE * squared @ sense,
        ]
    )


@pytest.mark.parametrize("name", LAYOUTS)
def test_thrust_equals_the_weight_without_errors(controller: Any, name: str) -> None:
    outputs = controller("multirotor_controller", parameters(LAYOUTS[name])).step({})
    assert loads(LAYOUTS[name], outputs) == pytest.approx([MASS * GRAVITY, 0, 0, 0], abs=1e-9)


@pytest.mark.parametrize("name", LAYOUTS)
def test_torques_follow_from_errors_and_gains(controller: Any, name: str) -> None:
    given = {
        "vehicle.attitude.roll": 0.1,
        "vehicle.attitude.pitch": -0.05,
        "vehicle.rates.r": 0.2,
        "yaw_reference": 0.1,
    }
    outputs = controller("multirotor_controller", parameters(LAYOUTS[name])).step(given)
    torques = [INERTIA[0] * 40 * -0.1, INERTIA[1] * 40 * 0.05, INERTIA[2] * (4 * 0.1 - 4 * 0.2)]
    thrust = MASS * GRAVITY / (math.cos(0.1) * math.cos(0.05))
    assert loads(LAYOUTS[name], outputs) == pytest.approx([thrust, *torques], rel=1e-9)


def test_unused_rotors_have_no_speed(controller: Any) -> None:
    outputs = controller("multirotor_controller", parameters(LAYOUTS["hexagon"])).step({})
    assert [outputs["rotor_speed[7]"], outputs["rotor_speed[8]"]] == [0.0, 0.0]


def test_it_tilts_towards_a_reference_ahead_and_to_the_left(controller: Any) -> None:
    for place, sign in (("x", [0, 1]), ("y", [-1, 0])):
        instance = controller("multirotor_controller", parameters(LAYOUTS["cross"]))
        roll_torque, pitch_torque = loads(
            LAYOUTS["cross"], instance.step({f"position_reference.{place}": 0.5})
        )[1:3]
        assert np.sign(np.round([roll_torque, pitch_torque], 9)).tolist() == sign


def test_rotors_do_not_exceed_their_limit(controller: Any) -> None:
    slow = parameters(LAYOUTS["plus"]) | {"rotor_speed_max": 500.0}
    outputs = controller("multirotor_controller", slow).step({"position_reference.z": 10.0})
    assert [outputs[f"rotor_speed[{k}]"] for k in (1, 2, 3, 4)] == [500.0] * 4
