"""Multirotors with mass and inertia set by parameters, as for a payload or a heavier battery."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from plant_fmu import PlantFmu
from scipy.spatial.transform import Rotation
from world_harness import PLATFORM, PLATFORM_TOP, REST_HEIGHT, WorldHarness, quadcopter_settings

import cosim
from cosim.core.errors import InputError
from plant_src.world import World

NAMES = ("xx", "yy", "zz", "xy", "xz", "yz")
#: principal axes far from those of the maker's
TURN = Rotation.from_rotvec([0.4, -0.7, 0.9]).as_matrix()
TENSOR = TURN @ np.diag([0.004, 0.006, 0.009]) @ TURN.T
MASS = 0.7


def inertia(tensor: np.ndarray) -> dict[str, float]:
    places = {f"inertia.{name}": ("xyz".index(name[0]), "xyz".index(name[1])) for name in NAMES}
    return {name: float(tensor[place]) for name, place in places.items()}


HEAVY = {"mass": MASS, **inertia(TENSOR)}


def test_loads_accelerate_it_by_its_own_mass_and_inertia() -> None:
    force, torque = np.array([0.3, -0.2, 0.5]), np.array([0.01, 0.02, -0.03])
    fmu = PlantFmu("ar_drone", {"initial.position.z": 100.0, **HEAVY})
    loads = {"external_force": force, "external_torque": torque}
    fmu.set(
        {
            f"{load}.{axis}": float(value)
            for load, vector in loads.items()
            for axis, value in zip("xyz", vector, strict=True)
        }
    )
    moment = 1e-4
    fmu.step(moment, 1)
    assert fmu.vector("velocity") == pytest.approx((force / MASS - [0, 0, 9.81]) * moment, rel=1e-6)
    assert fmu.vector("rates", "pqr") == pytest.approx(
        np.linalg.solve(TENSOR, torque) * moment, rel=1e-4
    )


def test_free_of_torque_it_keeps_angular_momentum_and_energy() -> None:
    start = {
        "initial.position.z": 1000.0,
        "initial.rates.p": 3.0,
        "initial.rates.q": 0.2,
        "initial.rates.r": -1.0,
    }
    fmu = PlantFmu("ar_drone", {**start, **HEAVY})

    def kept() -> np.ndarray:
        rates = fmu.vector("rates", "pqr")
        w, x, y, z = fmu.vector("orientation", "wxyz")
        return np.append(
            Rotation.from_quat([x, y, z, w]).apply(TENSOR @ rates), rates @ TENSOR @ rates / 2
        )

    before = kept()
    fmu.step(0.01, 500)
    assert kept() == pytest.approx(before, rel=1e-6, abs=1e-9)


def test_it_stands_level_and_presses_with_its_weight() -> None:
    """Its axes in Bullet differ, but its feet are at the same place."""
    place = [0.1, -0.2, PLATFORM_TOP + 0.05 + REST_HEIGHT]
    trial = WorldHarness(
        {"uav": quadcopter_settings(place, yaw=0.3, parameters=HEAVY)}, {"pad": PLATFORM}
    ).step(200)
    assert trial["uav.contact.force"] == pytest.approx(MASS * 9.81, rel=1e-6)
    assert trial.vector("uav.attitude", ("roll", "pitch", "yaw")) == pytest.approx(
        [0, 0, 0.3], abs=2e-3
    )
    assert trial["uav.position.z"] == pytest.approx(PLATFORM_TOP + REST_HEIGHT, abs=1e-3)


def test_an_impact_at_the_rim_turns_it_about_its_own_axes() -> None:
    """The change of angular momentum is that of an impulse at the foot that has touched."""
    motion = {"yaw": 0.3, "rates": [0.5, 0.8, 0.0], "velocity_body": [0.0, 0.0, -1.0]}
    uav = quadcopter_settings(
        [0.0, 0.0, PLATFORM_TOP + REST_HEIGHT + 0.12], parameters=HEAVY, **motion
    )
    trial = WorldHarness({"uav": uav}, {"pad": PLATFORM})
    trial["uav.external_force.z"] = MASS * 9.81
    momenta = []
    while not trial["uav.contact.touching"]:
        w, x, y, z = trial.step().vector("uav.orientation", "wxyz")
        to_world = Rotation.from_quat([x, y, z, w]).as_matrix()
        momenta.append(
            (
                MASS * trial.vector("uav.velocity"),
                to_world @ TENSOR @ trial.vector("uav.rates", "pqr"),
            )
        )
    impulse, angular = np.diff(momenta[-2:], axis=0)[0]
    feet = [
        to_world @ [x, y, -REST_HEIGHT]
        for x, y in ((0.164, 0.0), (-0.16, 0.0), (0.0, 0.16), (0.0, -0.164))
    ]
    errors = [
        np.linalg.norm(angular - np.cross(foot, impulse)) / np.linalg.norm(angular) for foot in feet
    ]
    assert np.linalg.norm(impulse) > 0.3
    assert min(errors) < 0.1


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"mass": -1.0},
            "vehicles.uav.parameters.mass: found -1.0, expected a finite number greater than 0",
        ),
        (
            {"mass": "heavy"},
            "vehicles.uav.parameters.mass: found 'heavy', expected a finite number",
        ),
        (
            inertia(np.diag([1.0, 1.0, 3.0])),
            "vehicles.uav.parameters.inertia.xx: .* none greater than the sum of the other two",
        ),
        (
            {"inertia.zz": -0.1},
            "vehicles.uav.parameters.inertia.xx: .* expected all greater than 0",
        ),
    ],
)
def test_impossible_bodies_are_refused_with_their_path(
    parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        World("plant", {"uav": quadcopter_settings([0.0, 0.0, 2.0], parameters=parameters)})


def test_a_scenario_sets_the_mass_at_the_place_that_the_message_names() -> None:
    place = "/components/plant/arguments/vehicles/uav/parameters/mass"
    with pytest.raises(
        InputError, match=f"is a constant and cannot be set: total mass .*; set by {place}"
    ):
        cosim.load("demo1_box", parameters={"plant.uav.mass": 0.5})
    with cosim.load("demo1_box", parameters={place: 0.5}) as simulation:
        assert simulation.get("plant.uav.mass") == 0.5
