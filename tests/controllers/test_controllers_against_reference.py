"""Controller FMUs against the equations of the fact sheet, with the shipped gains and with random
ones.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import controller_reference
import numpy as np
import pytest

TICKS = 600
GAINS: dict[str, dict[str, float]] = {
    "position_controller": {
        "position_P": 2.0,
        "position_I": 1.1,
        "speed_limit": 2.0,
        "velocity_P": 19.6600401691244,
        "velocity_D": 0.259478709550943,
        "velocity_N": 3.0476144677615,
        "tilt_limit": 15.0,
    },
    "altitude_controller": {
        "altitude_P": 170.242040782586,
        "altitude_I": 28.86184465251,
        "altitude_D": 50.0,
        "altitude_N": 50.0,
        "throttle_min": 35.0,
        "throttle_max": 90.0,
        "mass": 0.441,
        "thrust_coefficient": 8.24e-6,
    },
    "attitude_controller": {
        "roll_P": 0.3217,
        "roll_I": 0.4324,
        "roll_D": 0.0583,
        "pitch_P": 0.3217336,
        "pitch_I": 0.4324,
        "pitch_D": 0.0583122,
        "tilt_N": 100.0,
        "tilt_limit": 20.0,
        "yaw_P": 0.665668467901894,
        "yaw_I": 0.340149010656045,
        "yaw_D": 0.313800354221384,
        "yaw_N": 96.4244783671056,
        "yaw_limit": 10.0,
    },
    "mixer": {},
    "waypoint_guidance": {"speed_command": 1.0, "acceptance_radius": 0.5},
    "speed_controller": {"speed_P": 82.65, "thrust_limit": 3.0},
    "heading_controller": {
        "heading_P": 1.5,
        "heading_D": 0.8,
        "heading_N": 21.4165136740303,
        "rudder_limit": np.radians(35.0),
    },
}
GAINS["strider_autopilot"] = (
    GAINS["waypoint_guidance"] | GAINS["speed_controller"] | GAINS["heading_controller"]
)
#: half the width of the random walk of every input, and where it is centred when not at 0
INPUTS: dict[str, dict[str, float | tuple[float, float]]] = {
    "position_controller": {
        "vehicle.position.x": 2.0,
        "vehicle.position.y": 2.0,
        "vehicle.velocity.x": 1.5,
        "vehicle.velocity.y": 1.5,
        "vehicle.attitude.yaw": 3.1,
        "position_reference.x": 2.0,
        "position_reference.y": 2.0,
        "velocity_reference.x": 1.0,
        "velocity_reference.y": 1.0,
    },
    "altitude_controller": {"vehicle.position.z": (1.0, 0.2), "altitude_reference": (1.0, 0.2)},
    "attitude_controller": {
        "vehicle.attitude.roll": 0.4,
        "vehicle.attitude.pitch": 0.4,
        "vehicle.attitude.yaw": 3.1,
        "roll_command": 0.3,
        "pitch_command": 0.3,
        "yaw_command": 3.1,
    },
    "mixer": {
        "throttle": (60.0, 60.0),
        "roll_difference": 25.0,
        "pitch_difference": 25.0,
        "yaw_difference": 15.0,
        "motor_share": (0.5, 0.5),
    },
    "waypoint_guidance": {"vehicle.position.x": 3.0, "vehicle.position.y": 3.0},
    "speed_controller": {"vehicle.velocity_body.u": (0.9, 0.03), "speed_reference": (0.9, 0.03)},
    "heading_controller": {"vehicle.attitude.yaw": 3.1, "heading_reference": 3.1},
    "strider_autopilot": {
        "vehicle.position.x": 3.0,
        "vehicle.position.y": 3.0,
        "vehicle.attitude.yaw": 3.1,
        "vehicle.velocity_body.u": (0.9, 0.3),
    },
}
REFERENCES: dict[str, Callable[..., Any]] = {
    "position_controller": controller_reference.PositionReference,
    "altitude_controller": controller_reference.AltitudeReference,
    "attitude_controller": controller_reference.AttitudeReference,
    "mixer": lambda _parameters: controller_reference.mix_rotor_speeds,
    "waypoint_guidance": controller_reference.Guidance,
    "speed_controller": controller_reference.SpeedReference,
    "heading_controller": controller_reference.HeadingReference,
    "strider_autopilot": controller_reference.Autopilot,
}
RESETTABLE = {"position_controller", "altitude_controller", "attitude_controller"}


def wandering(name: str, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Inputs of every tick: jumps and smooth parts, with a reset at some ticks."""
    ticks: list[dict[str, Any]] = [{} for _ in range(TICKS)]
    for variable, span in INPUTS[name].items():
        centre, half = span if isinstance(span, tuple) else (0.0, span)
        knots = rng.uniform(-half, half, TICKS // 20 + 2)
        values = (
            centre
            + np.interp(np.arange(TICKS) / 20, np.arange(len(knots)), knots)
            + half / 20 * rng.normal(size=TICKS)
        )
        for tick, value in zip(ticks, values, strict=True):
            tick[variable] = float(value)
    for k, tick in enumerate(ticks):
        if name in RESETTABLE:
            tick["reset"] = k < 3 or 0 <= k % 250 - 200 < 5
    return ticks


def waypoints(rng: np.random.Generator, end_policy: int) -> dict[str, Any]:
    x, y = rng.uniform(-2, 2, (2, 32)).tolist()
    return {"waypoint_count": 6, "waypoint_x": x, "waypoint_y": y, "end_policy": end_policy}


def assert_agreement(
    fmu: Any, reference: Callable[..., dict[str, Any]], ticks: list[dict[str, Any]]
) -> None:
    for k, inputs in enumerate(ticks):
        found, expected = fmu.step(inputs), reference(inputs)
        for name, value in expected.items():
            assert found[name] == pytest.approx(value, rel=1e-11, abs=1e-11), f"{name} at tick {k}"


@pytest.mark.parametrize("name", GAINS)
def test_shipped_gains_are_those_of_the_fact_sheet(controller: Any, name: str) -> None:
    rng = np.random.default_rng(1)
    extra = waypoints(rng, end_policy=1) if "acceptance_radius" in GAINS[name] else {}
    assert_agreement(
        controller(name, extra), REFERENCES[name](GAINS[name] | extra), wandering(name, rng)
    )


@pytest.mark.parametrize("seed", range(2, 5))
@pytest.mark.parametrize("name", [name for name in GAINS if name != "mixer"])
def test_every_gain_is_a_parameter(controller: Any, name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    gains = {gain: value * float(rng.uniform(0.5, 1.5)) for gain, value in GAINS[name].items()}
    extra = waypoints(rng, end_policy=seed - 1) if "acceptance_radius" in GAINS[name] else {}
    assert_agreement(
        controller(name, gains | extra), REFERENCES[name](gains | extra), wandering(name, rng)
    )


def test_gains_can_be_tuned_while_running(controller: Any) -> None:
    fmu = controller("altitude_controller")
    fmu.step({"altitude_reference": 1.0, "vehicle.position.z": 1.0, "reset": False})
    fmu.set({"altitude_P": 100.0, "altitude_D": 0.0, "altitude_I": 0.0})
    low = fmu.step({"altitude_reference": 1.1})["throttle"]
    fmu.set({"altitude_P": 200.0})
    assert fmu.step({})["throttle"] - low == pytest.approx(10.0)


def test_hover_throttle_follows_the_mass(controller: Any) -> None:
    assert controller("altitude_controller").get("hover_throttle") == pytest.approx(69.19, abs=0.01)
    heavier = controller("altitude_controller", {"mass": 4 * 0.441, "throttle_max": 200.0})
    assert heavier.get("hover_throttle") == pytest.approx(2 * 69.19, abs=0.01)
    assert heavier.step({"reset": True})["throttle"] == heavier.get("hover_throttle")
