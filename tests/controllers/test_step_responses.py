"""Step responses of the control loops with the quadcopter's equations against a published
re-simulation.

The original charged its altitude integrator from 0 in the first seconds; a controller that believes
in no mass does the same. The figures hold within 3 % or 0.05 s.
"""

from __future__ import annotations

from itertools import chain
from math import pi
from typing import Any

import numpy as np
import pytest

LOOPS = ("position_controller", "altitude_controller", "attitude_controller", "mixer")
ROTORS = [f"rotor_speed[{n}]" for n in range(1, 5)]


def respond(
    controller: Any, seconds: float, step: dict[str, float], mass: float
) -> dict[str, np.ndarray]:
    """From rest at the origin, the step after one tick: time histories of the quadcopter's outputs
    and of the throttle.
    """
    plant = controller("ar_drone")
    loops = [
        controller(name, {"mass": mass} if name == "altitude_controller" else {}) for name in LOOPS
    ]
    outputs = [variable.name for variable in chain.from_iterable(plant.outputs.values())]
    bus: dict[str, Any] = {f"vehicle.{name}": plant.get(name) for name in outputs} | {
        "reset": False,
        "motor_share": 1.0,
    }
    rows = []
    for _ in range(round(seconds / 0.01)):
        for loop in loops:
            bus |= loop.step({name: bus[name] for name in loop.inputs if name in bus})
        state = plant.step({name: bus[name] for name in ROTORS})
        bus |= {f"vehicle.{name}": value for name, value in state.items()} | step
        rows.append(state | {"throttle": bus["throttle"]})
    values = np.array([list(row.values()) for row in rows]).T
    return dict(zip(rows[0], values, strict=True))


def rise_time(signal: np.ndarray) -> float:
    """Time (s) at which the signal first reaches 90 % of its final command, 1."""
    return 0.01 * int(np.argmax(signal >= 0.9))


def settling_time(signal: np.ndarray, band: float) -> float:
    """Time (s) from which the signal stays within the band around 1."""
    return 0.01 * (1 + int(np.flatnonzero(np.abs(signal - 1) > band)[-1]))


def test_position_step(controller: Any) -> None:
    run = respond(controller, 6.0, {"position_reference.x": 1.0}, mass=0.0)
    x = run["position.x"]
    assert rise_time(x) == pytest.approx(1.05, abs=0.05)
    assert x.max() - 1 == pytest.approx(0.335, rel=0.03)
    assert settling_time(x, band=0.05) == pytest.approx(3.3, rel=0.03)
    assert np.degrees(run["attitude.pitch"].max()) == pytest.approx(16.4, rel=0.03)
    assert np.abs(run["position.z"]).max() == pytest.approx(0.364, rel=0.03)


def test_yaw_step(controller: Any) -> None:
    yaw = respond(controller, 6.0, {"yaw_command": pi / 2}, mass=0.0)["attitude.yaw"] / (pi / 2)
    assert rise_time(yaw) == pytest.approx(1.25, abs=0.05)
    assert 90 * (yaw.max() - 1) == pytest.approx(13.3, rel=0.03)
    assert settling_time(yaw, band=5 / 90) == pytest.approx(4.85, rel=0.03)


def test_hover_feed_forward_keeps_the_altitude(controller: Any) -> None:
    run = respond(controller, 6.0, {"position_reference.x": 1.0}, mass=0.441)
    assert np.abs(run["position.z"]).max() < 0.01
    assert run["throttle"][-1] == pytest.approx(69.42, abs=0.05)
