"""The published controller by inverse kinematics, and its demo."""

from __future__ import annotations

import math

import numpy as np
import pytest

import cosim
from plant_src.replica.inverse_kinematics import (
    InverseKinematics,
    low_pass_matrices,
    low_pass_steady_state,
    return_move_acceleration,
    stop_move_acceleration,
)

HOVER = 0.443892 * 9.81


def response(frequency: float) -> float:
    """Amplitude of the low-pass, stepped finely, at a frequency in Hz."""
    step_size = 1e-4
    turn, gain = low_pass_matrices(step_size)
    z = np.exp(2j * math.pi * frequency * step_size)
    return float(abs(np.linalg.solve(z * np.eye(15) - turn, gain)[-1]))


@pytest.mark.parametrize("frequency", [2.0, 15.0, 20.0, 25.0, 40.0])
def test_the_low_pass_is_a_butterworth_of_order_15_at_20_hertz(frequency: float) -> None:
    assert response(frequency) == pytest.approx(1 / math.sqrt(1 + (frequency / 20) ** 30), rel=5e-3)


def test_the_low_pass_at_rest_stays_there() -> None:
    turn, gain = low_pass_matrices(0.01)
    state = low_pass_steady_state(4.3)
    np.testing.assert_allclose(turn @ state + gain * 4.3, state, atol=1e-9)


def controller(**values: float) -> dict[str, float]:
    """Outputs of a controller that hovers at its altitude."""
    unit = InverseKinematics(instance_name="inverse")
    unit.values |= {
        "initial_force": HOVER,
        "altitude_command": 2.0,
        "vehicle.position.z": 2.0,
        **values,
    }
    unit.exit_initialization_mode()
    assert unit.do_step(0.0, 0.01)
    return unit.values


def test_without_accelerations_it_hovers_level() -> None:
    values = controller()
    assert values["throttle"] == pytest.approx(65.88, abs=0.01)
    assert (values["phi_command"], values["theta_command"]) == (0, 0)


def test_the_thrust_points_along_the_wanted_force() -> None:
    values = controller(forward_acceleration=2.0, right_acceleration=1.0)
    force = np.array([2 * 0.441, 0.441, HOVER])
    phi, theta = values["phi_command"], values["theta_command"]
    up = [-math.sin(theta), math.cos(theta) * math.sin(phi), math.cos(theta) * math.cos(phi)]
    np.testing.assert_allclose(up, force / np.linalg.norm(force), rtol=1e-12)
    assert values["throttle"] == pytest.approx(
        65.88 * math.sqrt(np.linalg.norm(force) / HOVER), rel=1e-3
    )


def test_the_force_starts_at_zero_as_published() -> None:
    values = controller(initial_force=0.0, right_acceleration=0.01)
    assert values["phi_command"] == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    ("profile", "distance", "speed"),
    [(return_move_acceleration, 0.0, 0.0), (stop_move_acceleration, 100.0, 10.0)],
)
def test_profiles_travel_as_far_as_published(profile, distance: float, speed: float) -> None:
    time = np.arange(0, 25, 1e-3) + 5e-4
    velocity = np.cumsum([profile(t) for t in time]) * 1e-3
    assert velocity[9999] == pytest.approx(speed, abs=1e-3)
    assert velocity[-1] == pytest.approx(0, abs=1e-3)
    assert velocity.sum() * 1e-3 == pytest.approx(distance, abs=2e-2)


@pytest.mark.parametrize(
    ("profile", "largest"), [(return_move_acceleration, 0.578), (stop_move_acceleration, 1.875)]
)
def test_profiles_peak_as_published(profile, largest: float) -> None:
    values = [profile(t) for t in np.arange(0, 20, 1e-2)]
    assert (max(values), min(values)) == pytest.approx((largest, -largest), rel=2e-3)


START = "/components/plant/arguments/vehicles/uav/position"


def test_started_in_hover_the_demo_goes_24_metres_sideways_and_comes_back() -> None:
    """At the commanded altitude, with altitude loop and filter at the weight."""
    result = cosim.run(
        "demo3_replica",
        parameters={"uav.inverse.initial_force": HOVER, START: [-5.125, 0.825, 2.0]},
    )
    assert result["plant.uav.position.x"][-1] + 5.125 == pytest.approx(24.3, abs=0.05)
    assert result["plant.uav.position.y"].max() - 0.825 > 4
    assert abs(result["plant.uav.position.y"][-1] - 0.825) == pytest.approx(0.23, abs=0.02)


def test_started_as_published_the_demo_drifts_away() -> None:
    """The first tilt commands are huge; they leave a velocity, and metres after 20 s (re-simulated:
    0.4 m/s and 8.3 m).
    """
    result = cosim.run("demo3_replica")
    assert np.abs(result["uav.inverse.phi_command"][result.time < 0.08]).max() > math.radians(80)
    assert 0.2 < result["plant.uav.velocity.y"][-1] < 0.8
    assert 5 < result["plant.uav.position.y"][-1] - 0.825 < 14
