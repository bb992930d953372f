"""Contact between vehicles, and with platforms."""

from __future__ import annotations

import math

import numpy as np
import original_system_reference as reference
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

WEIGHT = reference.QUADCOPTER_MASS * reference.GRAVITY


def rotor_speed(share: float) -> list[float]:
    """Rotor speeds whose thrust is this share of the weight."""
    return [reference.HOVER_SPEED * math.sqrt(share)] * 4


def on_deck(height: float = 0.001, **more: object) -> WorldHarness:
    """A quadcopter above the middle of the deck of a vessel in the origin, whose hulls have no
    resistance.
    """
    uav = quadcopter_settings([-0.0135, 0.002, DECK_TOP + REST_HEIGHT + height], **more)
    return WorldHarness({"uav": uav, "usv": vessel_settings([0.0, 0.0], hull="paper")})


@pytest.fixture(scope="module")
def parked() -> WorldHarness:
    """A quadcopter with its motors off, at rest on the deck for 2 s."""
    return on_deck().step(200)


def test_at_rest_the_contact_force_is_the_weight(
    parked: WorldHarness, measured: MeasurementCheck
) -> None:
    force = parked["uav.contact.force"]
    measured(
        "Contact",
        "force of an AR.Drone at rest on a planar deck",
        force,
        WEIGHT,
        "N",
        "weight",
        relative=1e-3,
    )
    assert parked["usv.contact.force"] == parked["uav.contact.force"]


def test_thrust_reduces_the_contact_force(measured: MeasurementCheck) -> None:
    trial = on_deck()
    trial["uav.rotor_speed"] = rotor_speed(0.3)
    trial.step(200)
    force = trial["uav.contact.force"]
    measured(
        "Contact",
        "the same with 30 % of thrust",
        force,
        0.7 * WEIGHT,
        "N",
        "weight less thrust",
        relative=1e-3,
    )


def test_at_rest_the_height_is_that_of_the_feet(
    parked: WorldHarness, measured: MeasurementCheck
) -> None:
    height = parked["uav.position.z"]
    measured(
        "Contact", "its height", height, DECK_TOP + REST_HEIGHT, "m", "deck and feet", within=1e-4
    )


def test_at_rest_velocities_read_zero(parked: WorldHarness, measured: MeasurementCheck) -> None:
    """The predicted velocity at the end of the step is not zero: gravity gives 0.05 m/s in half a
    step.
    """
    measured(
        "Contact", "its velocity", parked.vector("uav.velocity"), 0.0, "m/s", "rest", within=1e-5
    )
    assert np.abs(parked.vector("uav.rates", "pqr")).max() < 1e-4


def test_contact_with_a_vessel_is_distinguished_from_a_platform(parked: WorldHarness) -> None:
    on_platform = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, PLATFORM_TOP + REST_HEIGHT])}, {"start": PLATFORM}
    ).step(20)
    assert (parked["uav.contact.touching"], parked["uav.contact.vessel"]) == (True, True)
    assert (on_platform["uav.contact.touching"], on_platform["uav.contact.vessel"]) == (True, False)
    assert (parked["usv.contact.touching"], parked["usv.contact.vessel"]) == (True, False)


def test_in_flight_nothing_touches() -> None:
    trial = on_deck(height=0.3).step(10)
    assert [trial[f"uav.contact.{name}"] for name in ("force", "touching", "vessel")] == [
        0.0,
        False,
        False,
    ]


def test_touchdown_stops_the_fall_within_a_step() -> None:
    """Boxes touch when they overlap, so the impulse comes in the step after the one in which the
    feet arrive.
    """
    height, trial = 0.05, on_deck(height=0.05)
    while not trial["uav.contact.touching"]:
        trial.step()
    arrival = math.sqrt(2 * height / reference.GRAVITY)
    assert arrival < trial.steps * 0.01 < arrival + 0.02
    fall = reference.GRAVITY * (trial.steps - 1) * 0.01
    assert trial["uav.contact.force"] * 0.01 == pytest.approx(
        reference.QUADCOPTER_MASS * fall, rel=0.15
    )
    assert abs(trial["uav.velocity.z"]) < 0.1 * fall


def test_contact_force_is_the_mean_over_a_long_step() -> None:
    trial = on_deck().step(100)
    trial.step(1, step_size=0.1)
    assert trial["uav.contact.force"] == pytest.approx(WEIGHT, rel=1e-3)


def test_contact_conserves_momentum(measured: MeasurementCheck) -> None:
    """A quadcopter slides onto a vessel at rest; the air drag of a few steps is negligible."""
    trial = on_deck(velocity_body=[1.0, 0.0, 0.0])
    trial["uav.rotor_speed"] = rotor_speed(0.3)
    trial.step(6)
    momentum = (
        reference.QUADCOPTER_MASS * trial["uav.velocity.x"]
        + reference.VESSEL_MASS * trial["usv.velocity.x"]
    )
    assert trial["usv.velocity.x"] > 0.02
    before = reference.QUADCOPTER_MASS * 1.0
    measured(
        "Contact",
        "momentum while sliding onto a planar vessel",
        momentum,
        before,
        "kg.m/s",
        "conservation",
        relative=1e-5,
    )


def test_friction_drags_the_vessel_along() -> None:
    """Both reach the common velocity of an inelastic impact, up to the small air drag."""
    trial = on_deck(velocity_body=[1.0, 0.0, 0.0]).step(60)
    common = reference.QUADCOPTER_MASS / (reference.QUADCOPTER_MASS + reference.VESSEL_MASS)
    assert trial["uav.velocity.x"] == pytest.approx(trial["usv.velocity.x"], abs=1e-4)
    assert trial["usv.velocity.x"] == pytest.approx(common, rel=0.02)


def test_the_deck_carries_the_quadcopter_along() -> None:
    start = {"velocity_body": [0.5, 0.0, 0.0]}
    uav = quadcopter_settings([-0.0135, 0.002, DECK_TOP + REST_HEIGHT + 0.001], **start)
    trial = WorldHarness(
        {"uav": uav, "usv": vessel_settings([0.0, 0.0], **start, rates=[0.0, 0.0, 0.1])}
    )
    trial["usv.thrust"], trial["usv.rudder_angle"] = 0.5, 0.1
    places = [place_on_deck(trial.step(100)) for _ in range(5)]
    assert np.linalg.norm(trial.vector("usv.position")) > 2.0
    assert np.linalg.norm(places[-1] - places[0]) < 1e-3
    assert trial.vector("uav.velocity") == pytest.approx(
        trial.vector("usv.deck.velocity"), abs=0.01
    )


def place_on_deck(trial: WorldHarness) -> np.ndarray:
    """Horizontal position of the quadcopter in the frame of the deck."""
    x, y, _ = trial.vector("uav.position") - trial.vector("usv.deck.position")
    yaw = trial["usv.attitude.yaw"]
    return np.array([x * math.cos(yaw) + y * math.sin(yaw), -x * math.sin(yaw) + y * math.cos(yaw)])


def test_take_off_from_the_deck() -> None:
    trial = on_deck().step(100)
    start = trial["uav.position.z"]
    for k in range(30):  # the motors need 0.3 s to spin up
        trial["uav.rotor_speed"] = rotor_speed(1.1 * (k + 1) / 30)
        trial.step()
    ramp_share = [max(0.0, 1.1 * (k + 1) / 30 - 1) for k in range(30)]
    trial.step(100)
    speed = height = 0.0
    for share in (*ramp_share, *[0.1] * 100):
        height, speed = (
            height + speed * 0.01 + share * reference.GRAVITY * 0.01**2 / 2,
            speed + share * reference.GRAVITY * 0.01,
        )
    assert not trial["uav.contact.touching"]
    assert trial["uav.position.z"] - start == pytest.approx(height, abs=0.01)


def test_two_pairs_do_not_affect_each_other(measured: MeasurementCheck) -> None:
    """They differ by rounding only: when one touches down, Bullet's step is repeated for all."""
    pair = {"uav": quadcopter_settings([0.0, 0.0, 0.4]), "usv": vessel_settings([0.0, 0.0])}
    distant = {"uav2": quadcopter_settings([50.0, 0.0, 0.5]), "usv2": vessel_settings([50.0, 0.0])}
    alone, together = WorldHarness(pair).step(100), WorldHarness(pair | distant).step(100)
    names = [variable.name for variable in alone.world.variables]
    change = max(
        np.max(np.abs(np.subtract(together[name], alone[name], dtype=float))) for name in names
    )
    measured(
        "Fleets",
        "change of a pair by a distant second pair",
        change,
        0.0,
        "SI",
        "the pair alone",
        within=1e-9,
    )
    assert together["uav2.contact.vessel"]


def test_vessels_push_each_other() -> None:
    trial = WorldHarness(
        {
            name: vessel_settings([x, 0.0], hull="paper", velocity_body=[v, 0.0, 0.0])
            for name, x, v in (("a", 0.0, 1.0), ("b", 1.2, 0.0))
        }
    )
    while not trial["b.contact.touching"]:
        trial.step()
    assert trial["a.contact.vessel"]
    assert trial["b.contact.vessel"]
    assert trial["b.velocity.x"] > 0.1
    assert trial["a.velocity.x"] + trial["b.velocity.x"] == pytest.approx(1.0, abs=0.02)


def test_a_vessel_stops_at_a_platform() -> None:
    wall = {"size": [0.1, 4.0, 1.0], "position": [1.0, 0.0, 0.0]}
    trial = WorldHarness({"usv": vessel_settings([0.0, 0.0])}, {"wall": wall})
    trial["usv.thrust"] = 2.0
    trial.step(400)
    assert trial["usv.position.x"] == pytest.approx(0.95 - 0.4895, abs=2e-3)
    assert trial["usv.contact.force"] == pytest.approx(2.0, rel=1e-3)
    assert abs(trial["usv.velocity.x"]) < 1e-6


def test_a_wet_platform_lets_the_quadcopter_slide_and_a_springy_one_lets_it_bounce() -> None:
    """Coulomb friction stops it after v^2 / (2 mu g); restitution e gives back e times the speed of
    the impact.

    Bullet's correction of the penetration in the step of the impact adds up to 13 % of the speed.
    """
    for friction in (0.1, 0.4):
        slippery = {"start": {**PLATFORM, "friction": friction}}
        vehicle = quadcopter_settings(
            [0.0, 0.0, PLATFORM_TOP + REST_HEIGHT], velocity_body=[0.8, 0.0, 0.0]
        )
        trial = WorldHarness({"uav": vehicle}, slippery)
        trial.step(300)
        assert trial["uav.position.x"] == pytest.approx(0.8**2 / (2 * friction * 9.81), rel=0.1)
    for restitution in (0.0, 0.5):
        vehicle = quadcopter_settings(
            [0.0, 0.0, PLATFORM_TOP + REST_HEIGHT + 0.2], restitution=1.0, crash_speed=9.0
        )
        trial = WorldHarness({"uav": vehicle}, {"start": {**PLATFORM, "restitution": restitution}})
        speeds = [trial.step()["uav.velocity.z"] for _ in range(40)]
        impact = np.sqrt(2 * 9.81 * 0.2)
        assert max(speeds) == pytest.approx(restitution * impact, abs=0.25)
