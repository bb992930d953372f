"""Requirements on the controller beyond the checks of its scenarios."""

from pathlib import Path

import pytest

import cosim

COURSE = Path(__file__).parents[1] / "scenarios/course.json"


@pytest.mark.parametrize("course", [0.5, -2.0])
def test_the_vessel_reaches_a_course_on_either_side(course: float) -> None:
    result = cosim.run(COURSE, parameters={"usv.course_command": course})
    assert result["vessel.attitude.yaw"][-1] == pytest.approx(course, abs=0.01)


def test_the_vessel_holds_a_low_speed() -> None:
    result = cosim.run(COURSE, parameters={"usv.speed_command": 0.6})
    assert result.kpis["speed.value"] == pytest.approx(0.6, abs=0.01)
