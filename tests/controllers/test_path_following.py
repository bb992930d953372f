"""Straight legs in current and waves: adaptive line of sight, heading loop with integral action and
wave filter.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.signal import bilinear, lfilter

import cosim
from cosim.core import resources

ROOT = resources.root()


def largest_error(result: cosim.Result) -> float:
    """Return the largest distance from the leg between 20 s and 55 s (m)."""
    steady = (result.time > 20) & (result.time < 55)
    return float(abs(result["vessel.position.y"][steady]).max())


@pytest.mark.parametrize("current", [-0.3, 0.3, 0.5])
def test_error_in_a_cross_current_vanishes(current: float) -> None:
    result = cosim.run("path_in_current", {"vessel.current.y": current}, stop_time=55)
    assert largest_error(result) < 0.05
    sideways = np.arcsin(current / 1.0)
    assert result["usv.crab_angle"][-1] == pytest.approx(sideways, rel=0.2)


def test_line_of_sight_to_the_waypoint_drifts_metres_off_the_leg() -> None:
    kpis = [
        {"name": "error", "python": "cosim.kpis:peak", "arguments": {"signal": "vessel.position.y"}}
    ]
    system = str(ROOT / "scenarios/systems/strider_autopilot.json")
    result = cosim.run(
        "path_in_current",
        {"/components/usv/system": system, "/kpis": kpis, "/checks": []},
        stop_time=55,
    )
    assert largest_error(result) > 6


def test_integral_action_removes_the_error_of_a_steady_moment(
    controller: Callable[..., Any],
) -> None:
    """With a heading error that does not change, the rudder angle grows until its limit."""
    fmu = controller("heading_autopilot")
    rudder = [fmu.step({"vehicle.attitude.yaw": 0.1})["rudder_angle"] for _ in range(1000)]
    assert rudder[500] - rudder[100] == pytest.approx(0.3 * 0.1 * 4.0, rel=1e-6)
    assert max(rudder) <= 0.6109


def test_wave_filter_is_the_notch_of_the_textbook(controller: Callable[..., Any]) -> None:
    """The rudder does not follow yaw motion of the wave period; slower motion passes."""
    pure = {
        "heading_P": 1.0,
        "heading_I": 0.0,
        "heading_D": 0.0,
        "wave_period": 1.25,
        "wave_depth": 0.0,
    }
    fmu, t = controller("heading_autopilot", pure), 0.01 * np.arange(3000)
    for period, lowest, highest in ((1.25, 0.0, 1e-3), (10.0, 0.98, 1.0)):
        yaw = 0.1 * np.sin(2 * np.pi * t / period)
        rudder = np.array([fmu.step({"vehicle.attitude.yaw": u})["rudder_angle"] for u in yaw])
        assert lowest <= abs(rudder[2000:]).max() / 0.1 <= highest
    w = 2 / 0.01 * np.tan(np.pi * 0.01 / 1.25)
    b, a = bilinear([1, 0, w * w], [1, 2 * 0.4 * w, w * w], fs=100)
    fmu, noise = controller("heading_autopilot", pure), np.random.default_rng(1).normal(0, 0.1, 300)
    noise[0] = 0.0
    found = [fmu.step({"vehicle.attitude.yaw": u})["rudder_angle"] for u in noise]
    np.testing.assert_allclose(found, lfilter(b, a, noise), atol=1e-12)
