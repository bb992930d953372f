"""Closed loop of the exported continuous PID controller and the FMU of a vessel, compared with the
same loop in SciPy.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import cosim

FMUS = Path(__file__).parents[3] / "fmus"
GAINS = {"P": 8.0, "I": 2.0, "D": 1.5, "N": 40.0, "tracking_time": 0.7, "u_min": -5.0, "u_max": 5.0}
HULL = {"resistance": 0.0, "propeller_diameter": 0.0}  # of the published simulator
STEP, MASS, DRAG = (
    0.01,
    4.11,
    0.1,
)  # s, kg, kg/m: surge of the vessel by the fact sheet of the published simulator


def fly(folder: Path, controller: str, **changes: float) -> cosim.Result:
    """Return the speed setpoint: 1.5 m/s, and 0.5 m/s after 10 s."""
    scenario = {
        "name": "speed_loop",
        "stop_time": 20.0,
        "step_size": STEP,
        "components": {
            "pid": {
                "fmu": str(FMUS / controller),
                "parameters": GAINS | {"reference": 1.5} | changes,
            },
            "vessel": {
                "fmu": str(FMUS / "strider.fmu"),
                "parameters": HULL | {"initial.velocity_body.u": 0.2},
            },
        },
        "connections": [
            {"from": "vessel.velocity_body.u", "to": "pid.measurement"},
            {"from": "pid.u", "to": "vessel.thrust"},
        ],
        "events": [{"time": 10.0, "set": {"pid.reference": 0.5}}],
    }
    path = folder / "speed_loop.json"
    path.write_text(json.dumps(scenario))
    return cosim.run(path)


def limited(
    reference: float, speed: float, integral: float, filtered: float
) -> tuple[float, float]:
    """Return the controller output and the amount by which the limits reduce it."""
    error, g = reference - speed, GAINS
    unlimited = g["P"] * error + integral + g["D"] * g["N"] * (error - filtered)
    u = min(g["u_max"], max(g["u_min"], unlimited))
    return u, u - unlimited


def controller_rate(_t: float, state: np.ndarray, reference: float, speed: float) -> list[float]:
    _, taken = limited(reference, speed, *state)
    error = reference - speed
    return [GAINS["I"] * error + taken / GAINS["tracking_time"], GAINS["N"] * (error - state[1])]


def vessel_rate(_t: float, state: np.ndarray, thrust: float) -> list[float]:
    return [(thrust - DRAG * abs(state[0]) * state[0]) / MASS]


def expected(duration: float) -> np.ndarray:
    """Return speed and thrust at every communication point, the controller stepped first."""

    def over_a_step(rate, state, *held):
        return solve_ivp(rate, (0, STEP), state, "DOP853", args=held, rtol=1e-11, atol=1e-12).y[
            :, -1
        ]

    speed, controller = (
        np.array([0.2]),
        np.array([0.0, 1.3]),
    )  # the filter starts with the error 1.5 - 0.2
    rows = [(speed[0], limited(1.5, speed[0], *controller)[0])]
    for k in range(round(duration / STEP)):
        reference = 1.5 if k < 1000 else 0.5
        controller = over_a_step(controller_rate, controller, reference, speed[0])
        thrust = limited(reference, speed[0], *controller)[0]
        speed = over_a_step(vessel_rate, speed, thrust)
        rows.append((speed[0], thrust))
    return np.array(rows)


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> cosim.Result:
    return fly(tmp_path_factory.mktemp("flight"), "continuous_pid.fmu")


def test_the_closed_loop_agrees_with_scipy(flight):
    reference = expected(12.0)
    rows = len(reference)
    assert flight["vessel.velocity_body.u"][:rows] == pytest.approx(reference[:, 0], abs=1e-5)
    assert flight["pid.u"][:rows] == pytest.approx(
        reference[:, 1], abs=1e-4
    )  # most where the limits begin to act inside a step


def test_both_fmi_versions_give_the_same_results(flight, tmp_path):
    other = fly(tmp_path, "fmi3/continuous_pid.fmu")
    assert np.array_equal(flight["vessel.velocity_body.u"], other["vessel.velocity_body.u"])


def test_the_speed_settles_with_limited_thrust(flight):
    speed, thrust = flight["vessel.velocity_body.u"], flight["pid.u"]
    assert (thrust.min(), thrust.max()) == (-5.0, 5.0)
    assert (speed[999], speed[-1]) == pytest.approx((1.5, 0.5), abs=0.02)
    assert speed.max() < 1.05 * 1.5


def test_back_calculation_keeps_the_overshoot_small(flight, tmp_path):
    without = fly(tmp_path, "continuous_pid.fmu", tracking_time=1e6)
    overshoots = [result["vessel.velocity_body.u"].max() - 1.5 for result in (flight, without)]
    assert overshoots[0] < 0.5 * overshoots[1]
