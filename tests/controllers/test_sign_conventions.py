"""Sign conventions: right-hand rule, body axes forward, left, up; rotors 1 front, 2 left, 3 rear, 4
right.
"""

from __future__ import annotations

from math import pi, radians
from typing import Any

import pytest

FRONT, LEFT, REAR, RIGHT = (f"rotor_speed[{n}]" for n in (1, 2, 3, 4))
REST = {"reset": False}


@pytest.fixture
def rotors(controller: Any) -> Any:
    """Rotor speeds at half throttle with the given differences."""
    mixer = controller("mixer")

    def speeds(**differences: float) -> dict[str, float]:
        none = dict.fromkeys(("roll_difference", "pitch_difference", "yaw_difference"), 0.0)
        return mixer.step({"throttle": 50.0, "motor_share": 1.0} | none | differences)

    return speeds


def test_raising_the_left_side_takes_the_left_rotor(rotors: Any) -> None:
    speed = rotors(roll_difference=10.0)
    assert speed[LEFT] > speed[FRONT] == speed[REAR] > speed[RIGHT]


def test_lowering_the_nose_takes_the_rear_rotor(rotors: Any) -> None:
    speed = rotors(pitch_difference=10.0)
    assert speed[REAR] > speed[LEFT] == speed[RIGHT] > speed[FRONT]


def test_turning_counter_clockwise_takes_front_and_rear_rotor(rotors: Any) -> None:
    speed = rotors(yaw_difference=10.0)
    assert speed[FRONT] == speed[REAR] > speed[LEFT] == speed[RIGHT]


def test_full_throttle_is_5000_rpm_and_more_is_not_possible(controller: Any) -> None:
    full = {"throttle": 100.0, "roll_difference": 20.0, "motor_share": 1.0}
    speed = controller("mixer").step(full)
    assert speed[LEFT] == speed[FRONT] == pytest.approx(5000 * 2 * pi / 60, rel=1e-7)
    assert speed[RIGHT] == pytest.approx(0.8 * speed[FRONT])


def test_stopped_motors_stand_still(controller: Any) -> None:
    speed = controller("mixer").step({"throttle": 90.0, "yaw_difference": 5.0, "motor_share": 0.0})
    assert set(speed.values()) == {0.0}


@pytest.mark.parametrize(
    ("axis", "error"),
    [("roll", 0.1), ("roll", -0.1), ("pitch", 0.1), ("pitch", -0.1), ("yaw", 0.1), ("yaw", -0.1)],
)
def test_attitude_is_corrected_towards_the_command(
    controller: Any, axis: str, error: float
) -> None:
    differences = controller("attitude_controller").step(REST | {f"{axis}_command": error})
    assert differences.pop(f"{axis}_difference") * error > 0
    assert set(differences.values()) == {0.0}


def test_yaw_turns_the_short_way_round(controller: Any) -> None:
    across = {"yaw_command": radians(170), "vehicle.attitude.yaw": radians(-170)}
    yaw_difference = controller("attitude_controller", {"yaw_limit": 100.0}).step(REST | across)[
        "yaw_difference"
    ]
    assert yaw_difference == pytest.approx(-20 * 0.665668467901894)


@pytest.mark.parametrize(
    ("yaw", "east_of_it", "command", "sign"),
    [(0.0, True, (
        "pitch_command"
    ), 1), (pi / 2, True, "roll_command", 1), (pi, True, "pitch_command", -1),
     (-pi / 2, True, "roll_command", -1), (0.0, False, "roll_command", -1), (pi / 2, False, (
         "pitch_command"
     ), 1)],
)  # fmt: skip
def test_tilts_towards_the_reference_at_every_yaw(
    controller: Any, yaw: float, east_of_it: bool, command: str, sign: int
) -> None:
    reference = {"position_reference.x": 0.1} if east_of_it else {"position_reference.y": 0.1}
    tilt = controller("position_controller").step(REST | reference | {"vehicle.attitude.yaw": yaw})
    assert sign * tilt.pop(command) > 0.01
    assert abs(tilt.popitem()[1]) < 1e-12


def test_feed_forward_keeps_the_speed_of_a_moving_reference(controller: Any) -> None:
    moving = {f"velocity_reference.{axis}": 0.7 for axis in "xy"}
    moving |= {f"vehicle.velocity.{axis}": 0.7 for axis in "xy"}
    tilt = controller("position_controller").step(REST | moving | {"vehicle.attitude.yaw": 0.3})
    assert list(tilt.values()) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_reset_levels_and_forgets(controller: Any) -> None:
    fmu, away = controller("position_controller"), {"position_reference.x": 0.3, "reset": False}
    first = fmu.step(away)
    for _ in range(50):
        fmu.step(away)
    assert set(fmu.step({"reset": True}).values()) == {0.0}
    assert fmu.step({"reset": False}) == first


@pytest.mark.parametrize(("yaw", "rudder"), [(0.2, 1), (-0.2, -1)])
def test_positive_rudder_answers_a_bow_too_far_to_port(
    controller: Any, yaw: float, rudder: int
) -> None:
    fmu = controller("strider_autopilot", {"waypoint_x": [100.0]})
    assert fmu.step({"vehicle.attitude.yaw": yaw})["rudder_angle"] * rudder > 0.1
