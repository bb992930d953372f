"""Contact of multirotors of all sizes with platforms and decks."""

from __future__ import annotations

import pytest
from world_harness import DECK_TOP, PLATFORM, PLATFORM_TOP, WorldHarness, vessel_settings

#: bottom of the collision shape from the centre of mass (m), whose frame is turned by less than 7
#: degrees
FEET = {"crazyflie": -0.012, "survey_hexacopter": -0.22}
MASS = {"crazyflie": 0.027, "survey_hexacopter": 4.78}


def dropped(model: str) -> WorldHarness:
    """2 s after a fall from 5 cm onto a platform."""
    vehicle = {
        "model": model,
        "position": [0.1, -0.2, PLATFORM_TOP + 0.05 - FEET[model]],
        "yaw": 0.3,
    }
    return WorldHarness({"uav": vehicle}, {"pad": PLATFORM}).step(200)


@pytest.mark.parametrize("model", FEET)
def test_it_stands_on_its_feet(model: str) -> None:
    trial = dropped(model)
    assert trial["uav.position.z"] == pytest.approx(PLATFORM_TOP - FEET[model], abs=1e-3)
    assert trial.vector("uav.attitude", ("roll", "pitch", "yaw")) == pytest.approx(
        [0, 0, 0.3], abs=1e-3
    )


@pytest.mark.parametrize("model", FEET)
def test_the_platform_carries_its_weight(model: str) -> None:
    assert dropped(model)["uav.contact.force"] == pytest.approx(MASS[model] * 9.81, rel=1e-3)


def test_a_planar_deck_carries_a_vehicle_heavier_than_its_vessel() -> None:
    """The deck behaves as a platform, although Bullet's vessel has 4.11 kg: the feet rise out of it
    by 8 % per step.
    """
    vehicles = {
        "usv": vessel_settings([0.0, 0.0]),
        "uav": {"model": "survey_hexacopter", "velocity_body": [0.0, 0.0, -0.3]},
    }
    heights, decks = {"deck": DECK_TOP, "platform": PLATFORM_TOP}, {}
    for deck, height in heights.items():
        position = [0.0, 0.0, height - FEET["survey_hexacopter"] + 0.0015]
        chosen = vehicles if deck == "deck" else {"uav": vehicles["uav"]}
        trial = WorldHarness(
            {**chosen, "uav": {**vehicles["uav"], "position": position}},
            {"pad": PLATFORM} if deck != "deck" else {},
        )
        decks[deck] = [trial.step()["uav.position.z"] - height for _ in range(60)]
    assert decks["deck"] == pytest.approx(decks["platform"], abs=2e-5)


@pytest.mark.parametrize("model", FEET)
def test_it_takes_off_again(model: str) -> None:
    trial = dropped(model)
    count = len(trial["uav.rotor_speed"])
    trial["uav.rotor_speed"] = [
        1.05 * {"crazyflie": 1728.0, "survey_hexacopter": 387.0}[model]
    ] * count
    trial.step(100)
    assert not trial["uav.contact.touching"]
    assert trial["uav.position.z"] > PLATFORM_TOP - FEET[model] + 0.2
    assert trial.vector("uav.position", "xy") == pytest.approx([0.1, -0.2], abs=0.02)
