"""Standard tests of the vehicles that are given by data alone: hover of a multirotor, straight run
and turn of a vessel.

The expected values follow from the data of each vehicle: balances of forces in steady motion, and
published figures.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from world_harness import WorldHarness

from cosim.core import resources
from plant_src.catalogue import MODELS
from plant_src.vehicles.planar_vessel.planar_vessel import PlanarVessel
from plant_src.vehicles.surface_vessel.surface_vessel import SurfaceVessel
from plant_src.vehicles.vessel.boat import Boat

DATA = resources.root() / "plant_src/vehicles/data"
MULTIROTORS = ["crazyflie", "x500", "survey_hexacopter"]
VESSELS = [name for name, model in MODELS.items() if model.boat]

#: steady speed at full thrust (m/s): figure of the maker or of the source, and its tolerance
PUBLISHED_SPEEDS = {
    "blueboat": (3.0, 0.1),
    "heron": (1.5, 0.05),
    "otter_measured": (3.1, 0.4),
    "wamv16": (2.07, 0.05),
    "cybership2": (1.0, 0.05),
}


def main_propellers(vessel: Boat) -> np.ndarray:
    return np.array([each.axis[0] > 0.9 for each in vessel.propellers])


def surge_balance(vessel: Boat, u: float) -> float:
    """Thrust of the main propellers at full speed minus resistance (N)."""
    thrust = sum(
        each.max_speed * (each.thrust_coefficient * each.max_speed - each.advance_coefficient * u)
        for each, main in zip(vessel.propellers, main_propellers(vessel), strict=True)
        if main
    )
    resistance = (vessel.linear_damping[0, 0] + vessel.air_drag[0] * u) * u
    if isinstance(vessel, SurfaceVessel):
        return thrust - resistance - vessel.quadratic_damping[0, 0] * u**2
    assert isinstance(vessel, PlanarVessel)
    return (
        thrust
        - resistance
        - vessel.quadratic_damping[0][0, 0] * u**2
        - vessel.cubic_damping[0] * u**3
    )


@pytest.mark.parametrize("name", MULTIROTORS)
def test_a_multirotor_hovers_where_thrust_equals_weight(name: str) -> None:
    model = MODELS[name]
    assert model.airframe is not None
    rotors, weight = model.airframe.rotors, 9.81 * model.body.mass
    speed = (weight / sum(rotor.thrust_coefficient for rotor in rotors)) ** 0.5
    assert speed < 0.9 * model.airframe.max_rotor_speed
    settings = {"model": name, "position": [0, 0, 50], "parameters": {"initial_rotor_speed": speed}}
    trial = WorldHarness({"uav": settings})
    trial["uav.rotor_speed"] = [speed] * len(rotors)
    trial.step(200)
    assert trial.vector("uav.position") == pytest.approx([0, 0, 50], abs=1e-3)
    assert trial["uav.attitude.yaw"] == pytest.approx(0, abs=1e-6)


@pytest.mark.parametrize("name", VESSELS)
def test_a_vessel_rests_runs_straight_and_turns(name: str) -> None:
    vessel = MODELS[name].boat
    assert vessel is not None
    trial = WorldHarness({"usv": {"model": name, "position": [0, 0]}})
    start = trial.vector("usv.position")
    trial.step(100)
    assert trial.vector("usv.position") == pytest.approx(start, abs=1e-9)
    main = main_propellers(vessel)
    full = np.array([each.max_speed for each in vessel.propellers]) * main
    trial["usv.propeller_speed"] = full.tolist()
    trial.step(4000)
    u, v = trial.vector("usv.velocity_body", "uv")
    published, tolerance = PUBLISHED_SPEEDS[name]
    assert u == pytest.approx(published, abs=tolerance)
    assert abs(surge_balance(vessel, u)) < 0.03 * surge_balance(
        vessel, 0.0
    )  # a floating vessel runs with a trim
    assert [v, trial["usv.position.y"]] == pytest.approx([0, 0], abs=1e-9)
    assert abs(trial["usv.attitude.pitch"]) < 0.1
    if any(rudder.max_angle for rudder in vessel.rudders):
        trial["usv.rudder_angle"] = [0.3] * len(vessel.rudders)
    else:
        trial["usv.propeller_speed"] = [
            0.5 * n if each.position[1] < 0 else n
            for n, each in zip(full, vessel.propellers, strict=True)
        ]
    trial.step(2000)
    assert not trial["usv.crashed"]
    assert (
        trial["usv.rates.r"] < -0.05
    )  # to starboard: away from the stronger propeller, and with a positive rudder angle
    assert trial["usv.velocity_body.v"] > 0.01  # it drifts outwards, with keels only little


def quantities(data: Any) -> Any:
    """Yield all quantities with a unit."""
    if isinstance(data, dict):
        data = list(data.values())
    for value in data if isinstance(data, list) else ():
        if isinstance(value, dict) and "value" in value:
            yield value
        yield from quantities(value)


@pytest.mark.parametrize("name", [*VESSELS, *MULTIROTORS, "bluerov2_heavy"])
def test_every_quantity_of_the_library_states_its_source(name: str) -> None:
    data = json.loads((DATA / f"{name}.json").read_text())
    assert {"sources", "validity"} <= data.keys()
    assert len(list(quantities(data))) > 8
    assert all("source" in each for each in quantities(data))
