"""Crashed and ditched vehicles: collisions, capsizes and the water surface."""

from __future__ import annotations

import logging
import math
from typing import Any

import pytest
from world_harness import (
    DECK_TOP,
    PLATFORM,
    PLATFORM_TOP,
    REST_HEIGHT,
    WorldHarness,
    quadcopter_settings,
    vessel_settings,
)

from plant_src.catalogue import MODELS

STAND = PLATFORM_TOP + REST_HEIGHT
CRASH_SPEED = MODELS["ar_drone"].crash_speed
CRASH_HEIGHT = CRASH_SPEED**2 / 2 / 9.81


def dropped(height: float, **more: Any) -> WorldHarness:
    """A quadcopter that falls from a height above the platform, one second after its release."""
    uav = quadcopter_settings([0.0, 0.0, STAND + height], **more)
    return WorldHarness({"uav": uav}, {"start": PLATFORM}).step(100)


def failures(trial: WorldHarness, vehicle: str = "uav") -> tuple[bool, bool]:
    return trial[f"{vehicle}.crashed"], trial[f"{vehicle}.ditched"]


def test_a_fall_onto_a_platform_is_a_crash_from_the_height_of_the_crash_speed_on(
    caplog: pytest.LogCaptureFixture,
) -> None:
    assert failures(dropped(0.9 * CRASH_HEIGHT)) == (False, False)
    with caplog.at_level(logging.WARNING):
        assert failures(dropped(1.1 * CRASH_HEIGHT)) == (True, False)
    (message,) = caplog.messages
    assert (
        message
        == "plant: t = 0.35 s: uav crashed: collision with start at 3.38 m/s, limit 3.10 m/s"
    )


def test_the_scenario_sets_the_crash_speed_of_a_vehicle() -> None:
    assert failures(dropped(0.9 * CRASH_HEIGHT, crash_speed=2.0)) == (True, False)
    assert failures(dropped(1.1 * CRASH_HEIGHT, crash_speed=4.0)) == (False, False)


def test_a_vehicle_that_grazes_a_platform_at_speed_has_crashed() -> None:
    assert failures(dropped(0.05, velocity_body=[CRASH_SPEED + 0.5, 0.0, 0.0])) == (True, False)
    assert failures(dropped(0.05, velocity_body=[1.0, 0.0, 0.0])) == (False, False)


def test_upside_down_in_contact_is_a_crash_but_a_roll_in_flight_is_none() -> None:
    half_a_turn_until_contact = math.pi / math.sqrt(2 * 0.2 / 9.81)
    assert failures(dropped(0.2, rates=[half_a_turn_until_contact, 0.0, 0.0])) == (True, False)
    flying = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, 30.0], rates=[7.0, 0.0, 0.0])}
    ).step(100)
    assert failures(flying) == (False, False)


def test_a_collision_is_a_crash_of_the_lighter_vehicle_only() -> None:
    """The quadcopter at 4.4 m/s can change the velocity of the vessel by 0.43 m/s."""
    uav = quadcopter_settings([-0.0135, 0.002, DECK_TOP + REST_HEIGHT + 1.0])
    trial = WorldHarness({"uav": uav, "usv": vessel_settings([0.0, 0.0])}).step(100)
    assert failures(trial) == (True, False)
    assert failures(trial, "usv") == (False, False)


@pytest.mark.parametrize(("speed", "crashed"), [(0.4, False), (1.0, True)])
def test_a_vessel_that_runs_against_a_quay_has_crashed(speed: float, crashed: bool) -> None:
    quay = {"size": [1.0, 4.0, 1.0], "position": [1.6, 0.0, 0.0]}
    vessel = vessel_settings([0.0, 0.0], velocity_body=[speed, 0.0, 0.0])
    trial = WorldHarness({"usv": vessel}, {"quay": quay}).step(300)
    assert failures(trial, "usv") == (crashed, False)


def test_a_capsized_vessel_has_crashed() -> None:
    trial = WorldHarness({"usv": vessel_settings([0.0, 0.0], motion="6dof")})
    trial["usv.external_torque.x"] = 3000.0
    while abs(trial["usv.attitude.roll"]) < math.radians(89):
        assert failures(trial.step(), "usv") == (False, False)
    assert failures(trial.step(30), "usv") == (True, False)


def test_a_quadcopter_below_the_still_water_is_ditched_for_good(
    caplog: pytest.LogCaptureFixture,
) -> None:
    trial = WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 0.5])})
    with caplog.at_level(logging.WARNING):
        while trial["uav.position.z"] >= 0:
            assert failures(trial) == (False, False)
            trial.step()
    assert failures(trial) == (False, True)
    trial["uav.external_force.z"] = 40.0
    assert trial.step(100)["uav.position.z"] > 0
    assert failures(trial) == (False, True)
    assert caplog.messages == ["plant: t = 0.33 s: uav ditched: 0.02 m below the water"]


def test_a_quadcopter_is_ditched_by_the_wave_at_its_place() -> None:
    """Hold a quadcopter below the highest crests: the first crest that reaches it ditches it."""
    waves = {"spectrum": "jonswap", "significant_height": 1.0, "peak_period": 4.0, "components": 16}
    height = 0.3
    vehicles = {"uav": quadcopter_settings([0.0, 0.0, height])}
    trial = WorldHarness(vehicles, environment={"seed": 3, "waves": waves})
    trial["uav.external_force.z"] = 0.443892 * 9.81
    elevation = (
        trial.world._environment.water_level
    )  # the sea is tested in tests/plant_src/environment
    while not trial.step()["uav.ditched"]:
        assert elevation(0.0, 0.0, trial.steps * 0.01) <= trial["uav.position.z"]
    assert elevation(0.0, 0.0, trial.steps * 0.01) > trial["uav.position.z"]
    assert trial.steps > 10


@pytest.mark.parametrize("steps", [20, 35, 60])
def test_failures_are_part_of_the_saved_state(steps: int) -> None:
    trial = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, STAND + 0.6])}, {"start": PLATFORM}
    ).step(steps)
    state = trial.world.get_state()
    expected = [trial.step().bytes for _ in range(60)]
    assert trial["uav.crashed"]
    trial.world.set_state(state)
    assert [trial.step().bytes for _ in range(60)] == expected
