"""Motion of the deck relative to the quadcopter: drift between the receivers, measured by sights of
the marker.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

AXES, LATENCY = "xyz", 0.05
ANGLE_NOISE, POSITION_NOISE, DRIFT = 0.015, 0.005, 0.02


def motion(t: float) -> tuple[np.ndarray, np.ndarray, Rotation]:
    """Return positions of quadcopter and deck (m) and the attitude of the quadcopter, all in
    motion.
    """
    quadcopter = np.array([0.5 * t, 0.2 * np.sin(3 * t), 1.0])
    deck = np.array([0.5 * t - 0.1, 0.1 * np.cos(2 * t), 0.2 * np.sin(2 * t)])
    return quadcopter, deck, Rotation.from_euler("ZYX", [0.4 * t, 0.2 * np.sin(4 * t), 0.1])


def step_inputs(
    k: int, offset: np.ndarray, rng: np.random.Generator, last: dict[str, float]
) -> dict[str, float]:
    """Return the inputs of tick k. Every third tick brings a sight that is LATENCY old; `offset`:
    drift between the receivers.
    """
    t = 0.01 * k
    quadcopter, deck, attitude = motion(t)
    inputs = {f"vehicle.position.{axis}": quadcopter[i] for i, axis in enumerate(AXES)}
    inputs |= {f"vessel.position.{axis}": deck[i] - offset[i] for i, axis in enumerate(AXES)}
    inputs |= {
        f"vehicle.orientation.{part}": attitude.as_quat()[i] for i, part in enumerate("xyzw")
    }
    if k > 10 and k % 3 == 0:
        then, place, turn = motion(t - LATENCY)
        sigma = np.hypot(POSITION_NOISE, ANGLE_NOISE * np.linalg.norm(place - then))
        sight = turn.inv().apply(place - then + rng.normal(0, sigma, 3))
        last |= {f"marker.position.{axis}": sight[i] for i, axis in enumerate(AXES)} | {
            "marker.time": t - LATENCY
        }
    return inputs | last


def final_error(controller: Callable[..., Any], seed: int) -> tuple[np.ndarray, float]:
    """Return the error of the deck's position after 1.5 s and its stated deviation."""
    rng, filter_fmu, last = (
        np.random.default_rng(seed),
        controller("deck_filter"),
        dict[str, float](),
    )
    offset, out = rng.normal(0, DRIFT, 3), dict[str, float]()
    for k in range(150):
        out = filter_fmu.step(step_inputs(k, offset, rng, last))
    return np.array([out[f"position.{axis}"] for axis in AXES]) - motion(1.49)[1], out[
        "offset_deviation"
    ]


def test_offset_between_the_receivers_is_found_and_its_deviation_is_true(
    controller: Callable[..., Any],
) -> None:
    results = [final_error(controller, seed) for seed in range(12)]
    errors, deviation = np.array([error for error, _ in results]), results[0][1]
    assert deviation < DRIFT / 4
    assert np.sqrt(np.mean(errors**2)) == pytest.approx(deviation, rel=0.35)


def test_without_sights_the_deck_is_where_the_vessel_says(controller: Callable[..., Any]) -> None:
    filter_fmu = controller("deck_filter")
    out = [
        filter_fmu.step({"vessel.position.x": 3.0, "vessel.velocity.z": 0.4}) for _ in range(50)
    ][-1]
    assert (out["position.x"], out["velocity.z"]) == (3.0, 0.4)
    assert out["offset_deviation"] == pytest.approx(DRIFT)
