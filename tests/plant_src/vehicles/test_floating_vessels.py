"""Vessels in six degrees of freedom without contact, against independent equations and exact
solutions.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from catamaran_reference import Catamaran
from plant_validation import MeasurementCheck
from world_harness import WorldHarness, vessel_settings

from plant_src.environment import sea
from plant_src.vehicles.strider_6dof import parameters as p

WATERS = {
    "seed": 3,
    "waves": {
        "spectrum": "jonswap",
        "significant_height": 0.06,
        "peak_period": 2.0,
        "direction": 0.4,
        "spreading": 2,
        "components": 12,
    },
    "wind": {"velocity": [-3.0, 1.0, 0.0]},
    "current": {"velocity": [0.2, -0.1]},
}


def afloat(**more: Any) -> dict[str, Any]:
    return vessel_settings([0.0, 0.0], motion="6dof", **more)


@pytest.mark.parametrize("duration", [2.0, pytest.param(60.0, marks=pytest.mark.long)])
def test_catamaran_in_waves_and_current_follows_its_equations(
    duration: float, measured: MeasurementCheck
) -> None:
    """Turning by the rudder, against an eighth-order method."""
    times = np.arange(1.0, duration + 1)
    reference = Catamaran(
        sea(WATERS), thrust=1.0, rudder=0.15, current=(0.2, -0.1), wind=(-3.0, 1.0, 0.0)
    )
    expected = reference.simulate(np.array([0.6, 0.05, 0, 0, 0, 0.1]), times)
    start = {"velocity_body": [0.6, 0.05, 0.0], "rates": [0.0, 0.0, 0.1]}
    trial = WorldHarness(
        {"usv": afloat(**start, parameters={"initial.on_waves": 0.0})}, environment=WATERS
    )
    trial["usv.thrust"], trial["usv.rudder_angle"] = 1.0, 0.15
    found = np.array([trial.step(100).vector("usv.position") for _ in times])
    assert np.ptp(expected[:, 2]) > 0.01
    error = np.linalg.norm(found - expected, axis=1)
    measured(
        "Strider, six degrees of freedom",
        "place in waves, wind and current",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
        case=f"{duration:g} s",
    )


def test_steady_speed_and_turning_are_those_in_the_plane(measured: MeasurementCheck) -> None:
    start = {"velocity_body": [1.2, 0.0, 0.0]}
    plane, space = (
        steady_turn(vehicle) for vehicle in (vessel_settings([0.0, 0.0], **start), afloat(**start))
    )
    measured(
        "Strider, six degrees of freedom",
        "u, v and r of a steady turn",
        space,
        plane,
        "m/s, rad/s",
        "planar model",
        relative=1e-4,
    )


def steady_turn(vehicle: dict[str, Any]) -> np.ndarray:
    """Surge, sway and yaw rate after a minute."""
    trial = WorldHarness({"usv": vehicle})
    trial["usv.thrust"], trial["usv.rudder_angle"] = 0.2, 0.1
    trial.step(6000)
    return np.array(
        [trial[f"usv.{name}"] for name in ("velocity_body.u", "velocity_body.v", "rates.r")]
    )


@pytest.mark.parametrize(
    ("displacement", "signal", "stiffness", "damping"),
    [
        ("initial.heave", "position.z", 0, p.DAMPING_RATIOS[0]),
        ("initial.roll", "attitude.roll", 1, p.DAMPING_RATIOS[1]),
        ("initial.pitch", "attitude.pitch", 2, p.DAMPING_RATIOS[2]),
    ],
)
def test_a_small_displacement_decays_as_a_damped_oscillation(
    displacement: str, signal: str, stiffness: int, damping: float, measured: MeasurementCheck
) -> None:
    """x = e^(-z w t) (cos w_d t + z / sqrt(1 - z^2) sin w_d t); 1e-6 is too small for the nonlinear
    damping.
    """
    size, time, w = 1e-6, 0.3, p.NATURAL_FREQUENCIES[stiffness]
    trial = WorldHarness({"usv": afloat(parameters={displacement: size})}).step(30)
    damped, root = w * np.sqrt(1 - damping**2) * time, np.sqrt(1 - damping**2)
    expected = (
        size * np.exp(-damping * w * time) * (np.cos(damped) + damping / root * np.sin(damped))
    )
    rest = p.CENTRE_OF_MASS_HEIGHT if stiffness == 0 else 0.0
    found, case = trial[f"usv.{signal}"] - rest, displacement.partition(".")[2]
    measured(
        "Strider, six degrees of freedom",
        "decay from 1e-6 after 0.3 s",
        found,
        expected,
        "m, rad",
        "closed form",
        within=1e-9,
        case=case,
    )


@pytest.mark.parametrize(
    "model", [{"model": "strider"}, {"model": "strider", "motion": "6dof"}, {"model": "otter"}]
)
def test_water_carries_a_vessel_along_sideways(
    model: dict[str, str], measured: MeasurementCheck
) -> None:
    trial = WorldHarness(
        {"usv": {**model, "position": [0.0, 0.0]}},
        environment={"current": {"velocity": [0.0, 0.3]}},
    )
    trial.step(3000)
    found, expected, case = (
        trial["usv.velocity_body.v"],
        0.3 * np.cos(trial["usv.attitude.yaw"]),
        " ".join(model.values()),
    )
    measured(
        "Wind and current",
        "sway after 30 s in a current abeam",
        found,
        expected,
        "m/s",
        "drift",
        within=1e-3,
        case=case,
    )


@pytest.mark.parametrize("motion", ["planar", "6dof"])
def test_wind_pushes_as_hard_as_the_same_speed_through_still_air(
    motion: str, measured: MeasurementCheck
) -> None:
    """At rest in a wind of 4 m/s the thrust balances the drag, 0.1 kg/m times its square."""
    trial = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0], motion=motion)},
        environment={"wind": {"velocity": [4.0, 0.0, 0.0]}},
    )
    trial["usv.thrust"] = -0.1 * 4.0**2
    trial.step(200)
    speed = trial["usv.velocity.x"]
    measured(
        "Wind and current",
        "speed of a held Strider in wind",
        speed,
        0.0,
        "m/s",
        "balance of forces",
        within=1e-9,
        case=motion,
    )
