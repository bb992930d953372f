"""Order of waypoints in the vessel's autopilot."""

from __future__ import annotations

from math import pi
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException

SQUARE = {"waypoint_count": 3, "waypoint_x": [10.0, 10.0, 0.0], "waypoint_y": [0.0, 10.0, 10.0]}
STOP, REPEAT, KEEP_COURSE = 1, 2, 3


def at(x: float, y: float) -> dict[str, float]:
    return {"vehicle.position.x": x, "vehicle.position.y": y}


def tour(fmu: Any) -> list[dict[str, Any]]:
    """Outputs at every waypoint of the square in turn."""
    return [fmu.step(at(10, 0)), fmu.step(at(10, 10)), fmu.step(at(0, 10))]


def test_starts_at_the_first_waypoint(controller: Any) -> None:
    out = controller("strider_autopilot", SQUARE).step(at(0, 0))
    assert (out["active_waypoint"], out["distance"], out["heading_reference"]) == (1, 10.0, 0.0)


def test_switches_on_the_circle_of_acceptance(controller: Any) -> None:
    fmu = controller("strider_autopilot", SQUARE | {"acceptance_radius": 2.0})
    assert fmu.step(at(7.99, 0))["active_waypoint"] == 1
    assert fmu.step(at(8.0, 0))["active_waypoint"] == 2


def test_turns_to_the_next_waypoint_in_the_tick_that_reaches_one(controller: Any) -> None:
    out = controller("strider_autopilot", SQUARE).step(at(10, 0))
    assert (out["active_waypoint"], out["distance"], out["heading_reference"]) == (2, 10.0, pi / 2)


def test_waypoints_are_visited_in_order(controller: Any) -> None:
    fmu = controller("strider_autopilot", SQUARE)
    assert fmu.step(at(0, 10))["active_waypoint"] == 1
    assert [out["active_waypoint"] for out in tour(fmu)] == [2, 3, 3]


def test_stop_brakes_and_stays_finished(controller: Any) -> None:
    fmu = controller("strider_autopilot", SQUARE | {"end_policy": STOP})
    assert [out["finished"] for out in tour(fmu)] == [False, False, True]
    out = fmu.step(at(50, 50) | {"vehicle.velocity_body.u": 0.5})
    assert out["finished"]
    assert out["thrust"] == -3.0


def test_repeat_begins_again(controller: Any) -> None:
    fmu = controller("strider_autopilot", SQUARE | {"end_policy": REPEAT})
    last = tour(fmu)[-1]
    assert (last["active_waypoint"], last["finished"]) == (1, False)
    assert [out["active_waypoint"] for out in tour(fmu)] == [2, 3, 1]


def test_keep_course_sails_on(controller: Any) -> None:
    fmu = controller("strider_autopilot", SQUARE | {"end_policy": KEEP_COURSE})
    fmu.step(at(10, 0)), fmu.step(at(10, 10))
    course = fmu.step(at(3, 10))["heading_reference"]
    out = fmu.step(at(0.1, 10.2))
    assert out["finished"]
    out = fmu.step(at(-20, 30) | {"vehicle.velocity_body.u": 0.99})
    assert out["heading_reference"] == course == pi
    assert out["thrust"] == pytest.approx(82.65 * 0.01)


@pytest.mark.parametrize(
    ("end_policy", "speeds"),
    [(STOP, [2.0, 2.0, 0.0]), (REPEAT, [2.0] * 3), (KEEP_COURSE, [2.0] * 3)],
)
def test_guidance_commands_no_speed_after_a_stop_only(
    controller: Any, end_policy: int, speeds: list[float]
) -> None:
    fmu = controller("waypoint_guidance", SQUARE | {"speed_command": 2.0, "end_policy": end_policy})
    assert [out["speed_reference"] for out in tour(fmu)] == speeds


def test_on_top_of_a_waypoint_nothing_is_undefined(controller: Any) -> None:
    out = controller("strider_autopilot", {"waypoint_x": [1.0]}).step(at(1, 0))
    assert out["finished"]
    assert out["rudder_angle"] == 0.0


def test_uses_all_32_waypoints(controller: Any) -> None:
    x = [float(k) for k in range(1, 33)]
    fmu = controller(
        "strider_autopilot", {"waypoint_count": 32, "waypoint_x": x, "waypoint_y": [0.0] * 32}
    )
    assert [fmu.step(at(k, 0))["active_waypoint"] for k in range(1, 33)] == [*range(2, 33), 32]


def test_new_waypoints_are_taken_up_on_the_way(controller: Any) -> None:
    fmu = controller("strider_autopilot", SQUARE)
    fmu.step(at(10, 0))
    fmu.set({"waypoint_y[2]": 20.0})
    assert fmu.step(at(10, 0))["distance"] == 20.0


@pytest.mark.parametrize("count", [0, 33, -1])
def test_impossible_waypoint_count_is_refused(controller: Any, count: int) -> None:
    with pytest.raises(FMICallException):
        controller("strider_autopilot", {"waypoint_count": count}).step(at(0, 0))
