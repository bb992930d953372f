"""Worlds in the Bullet client of a former world: the same bytes as in a new client, whatever the
former world left.
"""

from __future__ import annotations

from collections.abc import Callable

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

from plant_src.physics import bullet
from plant_src.replica.world import World as Replica


@pytest.fixture(autouse=True)
def only_new_clients(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bullet, "_spare_clients", [])


def landing() -> bytes:
    """Touch down on a moving deck and stay for a second; all outputs of all steps."""
    uav = quadcopter_settings(
        [-0.0135, 0.002, DECK_TOP + REST_HEIGHT + 0.05], yaw=0.3, velocity_body=[0.3, 0.0, 0.0]
    )
    trial = WorldHarness(
        {"uav": uav, "usv": vessel_settings([0.0, 0.0], velocity_body=[0.3, 0.0, 0.0])}
    )
    history = b"".join(trial.step().bytes for _ in range(130))
    assert trial["uav.contact.vessel"]
    trial.world.free()
    return history


def leave_replica_with_gravity_and_small_steps() -> None:
    world = Replica("plant", {"uav": {"position": [0, 0, 10]}, "usv": {"position": [30.0, 0.0]}})
    world.do_step(0.0, 0.01)
    world.free()


def leave_bodies_in_contact_and_saved_states() -> None:
    standing = quadcopter_settings([0.0, 0.0, PLATFORM_TOP + REST_HEIGHT])
    trial = WorldHarness({"uav": standing}, {"start": PLATFORM}).step(60, step_size=0.003)
    trial.world.get_state()
    trial.world.free()


@pytest.mark.parametrize(
    "leave",
    [landing, leave_replica_with_gravity_and_small_steps, leave_bodies_in_contact_and_saved_states],
)
def test_a_landing_in_a_used_client_has_the_bytes_of_one_in_a_new_client(
    leave: Callable[[], object],
) -> None:
    in_new_client = landing()
    bullet._spare_clients.clear()
    leave()
    (kept,) = bullet._spare_clients
    assert landing() == in_new_client
    assert bullet._spare_clients == [kept]


def test_one_client_is_kept_and_the_others_are_disconnected() -> None:
    worlds = [WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 5.0])}).world for _ in range(3)]
    numbers = [world._client for world in worlds]
    assert len(set(numbers)) == 3
    for world in worlds:
        world.free()
    assert [bullet.pybullet.isConnected(number) for number in numbers] == [True, False, False]


def test_a_world_that_is_freed_twice_releases_its_client_once() -> None:
    world = WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 5.0])}).world
    world.free()
    world.free()
    assert len(bullet._spare_clients) == 1
