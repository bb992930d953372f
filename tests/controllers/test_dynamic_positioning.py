"""Station keeping of the Otter with two propellers, heading free."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import cosim

THRUST_AHEAD, THRUST_ASTERN, ARM = 0.01108, 0.006445, 0.395


def weather(current: tuple[float, float], wind: tuple[float, float]) -> dict[str, float]:
    names = ("vessel.current.x", "vessel.current.y", "vessel.wind.x", "vessel.wind.y")
    return dict(zip(names, (*current, *wind), strict=True))


@pytest.mark.parametrize("towards", [1.2, -1.8])
def test_otter_stays_within_half_a_metre_and_turns_into_the_weather(towards: float) -> None:
    c, s = math.cos(towards), math.sin(towards)
    result = cosim.run("station_keeping", weather((0.3 * c, 0.3 * s), (7 * c, 7 * s)))
    error = result["usv.position_error"]
    assert np.sqrt(np.mean(error**2)) < 0.5
    assert np.sqrt(np.mean(error[result.time > 60] ** 2)) < 0.1
    off_the_weather = result["vessel.attitude.yaw"][-1] - towards - math.pi
    assert math.cos(off_the_weather) > 0.97


def test_without_weather_the_propellers_rest(controller: Callable[..., Any]) -> None:
    out = controller("dynamic_positioning").step({})
    assert (out["propeller_speed[1]"], out["propeller_speed[2]"], out["position_error"]) == (
        0.0,
        0.0,
        0.0,
    )


@pytest.mark.parametrize(
    ("velocity", "yaw_rate"), [((0.3, 0.0), 0.0), ((-0.3, 0.1), 0.2), ((0.0, 0.2), -0.3)]
)
def test_allocation_produces_the_wanted_surge_force_and_yaw_moment(
    controller: Callable[..., Any], velocity: tuple[float, float], yaw_rate: float
) -> None:
    """At the station only the velocity of the hinge, 1 m ahead, counts: damping of 1.4 times mass
    85 kg or inertia 42 kg m2.
    """
    inputs = {
        "vehicle.velocity.x": velocity[0],
        "vehicle.velocity.y": velocity[1],
        "vehicle.rates.r": yaw_rate,
    }
    out = controller("dynamic_positioning").step(inputs)
    speeds = [out["propeller_speed[1]"], out["propeller_speed[2]"]]
    port, starboard = ((THRUST_AHEAD if n > 0 else -THRUST_ASTERN) * n * n for n in speeds)
    assert port + starboard == pytest.approx(-1.4 * 85 * velocity[0], abs=1e-9)
    assert ARM * (starboard - port) == pytest.approx(-1.4 * 42 * (velocity[1] + yaw_rate), abs=1e-9)


def test_steering_has_priority_at_the_limit_of_the_propellers(
    controller: Callable[..., Any],
) -> None:
    out = controller("dynamic_positioning").step(
        {"vehicle.rates.r": -3.0, "vehicle.velocity.x": -5.0}
    )
    port, starboard = out["propeller_speed[1]"], out["propeller_speed[2]"]
    assert starboard == pytest.approx(100.0)
    assert THRUST_AHEAD * starboard**2 + THRUST_ASTERN * port**2 == pytest.approx(
        2 * THRUST_ASTERN * 100**2
    )
