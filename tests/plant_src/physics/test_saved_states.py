"""Determinism and restoring of saved states, bit for bit."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import original_system_reference as reference
import pytest
from plant_validation import MeasurementCheck
from world_harness import DECK_TOP, REST_HEIGHT, WorldHarness, quadcopter_settings, vessel_settings

from cosim.core.errors import ComponentError

AGAIN = "40 steps from flight, touchdown and rest, repeated"
ROOT = Path(__file__).parents[3]


def mission() -> WorldHarness:
    """Drop from 0.15 m onto a moving, turning deck: 17 steps of flight, touchdown, rest."""
    uav = quadcopter_settings(
        [-0.0135, 0.002, DECK_TOP + REST_HEIGHT + 0.15], yaw=0.3, velocity_body=[0.3, 0.0, 0.0]
    )
    trial = WorldHarness(
        {
            "uav": uav,
            "usv": vessel_settings(
                [0.0, 0.0], velocity_body=[0.3, 0.0, 0.0], rates=[0.0, 0.0, 0.2]
            ),
        }
    )
    trial["uav.rotor_speed"] = [120.0, 121.0, 119.0, 120.0]
    trial["usv.thrust"] = 1.0
    return trial


def visit() -> WorldHarness:
    """Drop from 0.6 m onto the deck, take-off: Bullet is active from the 34th step to the 81st."""
    trial = WorldHarness(
        {
            "uav": quadcopter_settings([-0.0135, 0.002, DECK_TOP + REST_HEIGHT + 0.6]),
            "usv": vessel_settings([0.0, 0.0]),
        }
    )
    trial["uav.external_force.z"] = 1.0
    return trial


@pytest.mark.parametrize("steps", [0, 20, 30, 45, 60])
def test_a_state_is_restored_whether_bullet_is_active_or_not(steps: int) -> None:
    trial = visit().step(steps)
    state, before = trial.world.get_state(), trial.bytes

    def up_and_away() -> list[bytes]:
        trial["uav.external_force.z"] = 1.0
        rows = [trial.step().bytes for _ in range(30)]
        trial["uav.external_force.z"] = 8.0
        return rows + [trial.step().bytes for _ in range(60)]

    expected = up_and_away()
    for _ in range(2):
        trial.world.set_state(state)
        trial.world.get_outputs()
        assert trial.bytes == before
        assert up_and_away() == expected


@pytest.mark.parametrize("steps", [0, 5, 17, 18, 19, 20, 60, 200])
def test_a_saved_state_is_restored_bit_for_bit(steps: int, measured: MeasurementCheck) -> None:
    trial = mission().step(steps)
    state, before = trial.world.get_state(), trial.bytes
    expected = [trial.step().bytes for _ in range(40)]
    for _ in range(2):
        trial.world.set_state(state)
        trial.world.get_outputs()
        assert trial.bytes == before
        differing = sum(trial.step().bytes != row for row in expected)
        measured(
            "Determinism and saved states",
            "steps that differ after a return, planar",
            differing,
            0,
            "1",
            AGAIN,
        )
    trial.world.free_state(state)


def test_a_saved_state_includes_the_inputs() -> None:
    trial = mission()
    state = trial.world.get_state()
    trial["uav.rotor_speed"] = [0.0] * 4
    trial.world.set_state(state)
    assert trial["uav.rotor_speed"] == [120.0, 121.0, 119.0, 120.0]


def test_a_state_saved_before_a_failure_can_be_restored() -> None:
    trial = mission().step(30)
    state = trial.world.get_state()
    expected = trial.step(10).bytes
    trial.world.set_state(state)
    trial["usv.thrust"] = float("nan")
    with pytest.raises(ComponentError, match=r"usv.thrust is nan"):
        trial.step()
    trial.world.set_state(state)
    trial["usv.thrust"] = 1.0
    assert trial.step(10).bytes == expected


def test_the_step_size_may_change_around_a_saved_state() -> None:
    trial = mission().step(10)
    state = trial.world.get_state()
    expected = trial.step(5, 0.004).bytes
    trial.step(3, 0.02)
    trial.world.set_state(state)
    assert trial.step(5, 0.004).bytes == expected


SCRIPT = """
import hashlib, sys
sys.path[:0] = {paths!r}
from test_saved_states import mission
trial, digest = mission(), hashlib.sha256()
for _ in range(300):
    digest.update(trial.step().bytes)
print(digest.hexdigest(), trial["uav.contact.vessel"])
"""


def test_two_processes_compute_the_same_bytes(measured: MeasurementCheck) -> None:
    script = SCRIPT.format(
        paths=[str(ROOT), str(ROOT / "tests/support"), str(Path(__file__).parent)]
    )
    outcomes = [
        subprocess.run(
            [sys.executable, "-c", script],
            capture_output=True,
            text=True,
            check=True,
            env={"PYTHONHASHSEED": seed},
        ).stdout
        for seed in ("1", "2")
    ]
    digests, landed = zip(*(outcome.split() for outcome in outcomes), strict=True)
    assert landed == ("True", "True")
    others = len(set(digests)) - 1
    measured(
        "Determinism and saved states",
        "other SHA-256 of a landing, 2 processes",
        others,
        0,
        "1",
        "other PYTHONHASHSEED",
    )


def test_worlds_in_one_process_do_not_disturb_each_other() -> None:
    alone = mission().step(100).bytes
    first, second = mission(), mission()
    for _ in range(100):
        first.step()
        second.step()
    assert first.bytes == second.bytes == alone
    assert reference.HOVER_SPEED > 120.0  # the motors do not lift: the mission ends on the deck
