"""Free motion without Bullet is the same as with Bullet in every step."""

from __future__ import annotations

import sys

import numpy as np
import original_system_reference as reference
import pybullet
import pytest
from plant_validation import MeasurementCheck
from world_harness import (
    DECK_TOP,
    PLATFORM,
    PLATFORM_TOP,
    REST_HEIGHT,
    WorldHarness,
    quadcopter_settings,
    vessel_settings,
)

import cosim
from cosim.results import Result
from plant_src.physics import clearance
from plant_src.physics.body import MAX_HEAVE

EVERYWHERE = 1e9  # m; with this near distance all vehicles are near each other


def landing() -> WorldHarness:
    """Tumbling free fall from 1.5 m above a sailing vessel: flight, approach, impact, rest."""
    start = {"velocity_body": [0.4, 0.0, 0.0], "rates": [0.3, -0.2, 0.5]}
    uav = quadcopter_settings([-0.0135, 0.002, DECK_TOP + REST_HEIGHT + 1.5], yaw=0.3, **start)
    usv = vessel_settings([0.0, 0.0], velocity_body=[0.4, 0.0, 0.0])
    trial = WorldHarness(
        {"uav": uav, "usv": usv}, {"far": {**PLATFORM, "position": [9.0, 9.0, 0.0]}}
    )
    trial["uav.rotor_speed"] = [200.0, 201.0, 199.0, 200.0]
    trial["usv.thrust"] = 0.5
    return trial


def rows(trial: WorldHarness, steps: int) -> np.ndarray:
    """Return the outputs after each step."""
    found = []
    for _ in range(steps):
        arrays = trial.step().outputs.arrays.values()
        found.append(np.concatenate([array.astype(float) for array in arrays]))
    return np.array(found)


@pytest.fixture
def always_bullet(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(clearance, "NEAR_DISTANCE", EVERYWHERE)


@pytest.fixture
def no_bullet(monkeypatch: pytest.MonkeyPatch) -> None:
    def step(*_: object) -> None:
        raise AssertionError("Bullet was stepped")

    monkeypatch.setattr(pybullet, "stepSimulation", step)


def test_flight_is_the_same_bit_for_bit_and_landing_within_rounding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shortcut = rows(trial := landing(), 200)
    assert trial["uav.contact.vessel"]
    monkeypatch.setattr(clearance, "NEAR_DISTANCE", EVERYWHERE)
    bullet = rows(landing(), 200)
    assert np.array_equal(shortcut[:51], bullet[:51])  # flight and approach
    assert np.abs(shortcut - bullet).max() < 1e-6


def error_of_bullet(trial: WorldHarness) -> float:
    """Return the largest difference between the poses in Bullet and the published ones (m, rad)."""
    bodies = [body.body_id for body in trial.world._fleet.bodies]
    (uav, _), (usv, q) = (
        pybullet.getBasePositionAndOrientation(body, trial.world._client) for body in bodies
    )
    in_bullet = [*uav, *usv, *pybullet.getEulerFromQuaternion(q)]
    published = np.concatenate(
        [
            trial.vector("uav.position"),
            trial.vector("usv.position"),
            [0.0, 0.0, trial["usv.attitude.yaw"]],
        ]
    )
    return float(np.abs(in_bullet - published).max())


@pytest.mark.usefixtures("always_bullet")
def test_bullet_agrees_in_free_flight() -> None:
    """Bullet integrates the bodies in all steps."""
    assert error_of_bullet(landing().step(60)) < 1e-12


def test_bullet_agrees_in_contact() -> None:
    trial = landing().step(1000)
    assert trial["uav.contact.vessel"]
    assert error_of_bullet(trial) < 2 * MAX_HEAVE


def test_bullet_is_not_stepped_when_nothing_is_near(request: pytest.FixtureRequest) -> None:
    trial = landing()
    request.getfixturevalue("no_bullet")
    trial.step(30)


def test_bullet_is_stepped_before_anything_touches(request: pytest.FixtureRequest) -> None:
    trial = landing()
    request.getfixturevalue("no_bullet")
    with pytest.raises(AssertionError, match="Bullet was stepped"):
        trial.step(100)
    assert 0.0 < trial["uav.position.z"] - DECK_TOP - REST_HEIGHT < 0.3


def test_after_take_off_bullet_is_no_longer_stepped(request: pytest.FixtureRequest) -> None:
    trial = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, PLATFORM_TOP + REST_HEIGHT])}, {"start": PLATFORM}
    ).step(20)
    assert trial["uav.contact.touching"]
    trial["uav.rotor_speed"] = [reference.HOVER_SPEED * 1.05] * 4
    trial.step(150)
    request.getfixturevalue("no_bullet")
    trial.step(10)
    assert not trial["uav.contact.touching"]


def test_an_inactive_body_is_no_obstacle() -> None:
    """The first vehicle leaves the platform; the second lands at the last active pose of the first
    one in Bullet.
    """
    place = [0.0, 0.0, PLATFORM_TOP + REST_HEIGHT]
    first, second = (
        quadcopter_settings(place, velocity_body=[0.0, 0.0, 4.0]),
        quadcopter_settings([0.0, 0.0, 3.0]),
    )
    trial = WorldHarness({"first": first, "second": second}, {"start": PLATFORM})
    trial["first.rotor_speed"] = [reference.HOVER_SPEED] * 4
    trial["first.external_force.x"] = 2.0
    trial.step(200)
    assert trial["first.position.x"] > 2.0
    assert trial.vector("second.position") == pytest.approx(place, abs=1e-3)


def flown(near: float | None, monkeypatch: pytest.MonkeyPatch) -> Result:
    """Run Demo 1 with another near distance (m)."""
    with cosim.load("demo1_box") as simulation:
        if near is not None:
            world = simulation.prepared.system.components["plant"]
            monkeypatch.setattr(
                sys.modules[type(world._fleet.clearance).__module__], "NEAR_DISTANCE", near
            )
        return simulation.run()


def test_demo1_lands_at_the_same_place_with_bullet_in_every_step(
    monkeypatch: pytest.MonkeyPatch, measured: MeasurementCheck
) -> None:
    shortcut, bullet = flown(None, monkeypatch), flown(EVERYWHERE, monkeypatch)
    assert np.array_equal(shortcut["uav.vtol.mode"], bullet["uav.vtol.mode"])
    for axis in "xyz":
        error = shortcut[f"plant.uav.position.{axis}"] - bullet[f"plant.uav.position.{axis}"]
        measured(
            "Contact",
            "Demo 1: place throughout",
            error,
            0.0,
            "m",
            "Bullet in every step",
            within=1e-6,
        )
