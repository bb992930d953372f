"""The Python example: the same class in process and as an exported FMU."""

import json
import math

import numpy as np
import pytest

import cosim
from cosim.core import resources

ROOT = resources.root()
SOURCES = {
    "in process": {"python": str(ROOT / "controllers/python/course_keeper.py:CourseKeeper")},
    "exported": {"fmu": str(ROOT / "fmus/python/course_keeper.fmu")},
}


def flown(tmp_path, source, course):
    start = {"initial.velocity_body.u": 0.5, "initial.yaw": 0.3}
    scenario = {
        "name": "course",
        "stop_time": 20,
        "step_size": 0.01,
        "components": {
            "keeper": {**SOURCES[source], "parameters": {"course_command": course}},
            "vessel": {"fmu": str(ROOT / "fmus/strider.fmu"), "parameters": start},
        },
        "connections": [{"from": "vessel", "to": "keeper.vehicle"}]
        + [
            {"from": f"keeper.{name}", "to": f"vessel.{name}"}
            for name in ("thrust", "rudder_angle")
        ],
    }
    file = tmp_path / "course.json"
    file.write_text(json.dumps(scenario))
    return cosim.run(file)


@pytest.mark.parametrize("course", [0.0, math.pi / 2, -3.0])
def test_it_turns_to_the_course_and_keeps_it(tmp_path, course):
    result = flown(tmp_path, "in process", course)
    error = result["vessel.attitude.yaw"] - course
    late = result.time > 15
    assert np.abs(np.arctan2(np.sin(error), np.cos(error)))[late].max() < 0.01
    assert result["vessel.velocity_body.u"][late] == pytest.approx(
        1.0, abs=0.02
    )  # without integral action


def test_in_process_and_exported_are_the_same_to_the_bit(tmp_path):
    first, second = (flown(tmp_path, source, 1.0) for source in SOURCES)
    for name in first:
        assert np.array_equal(first[name], second[name]), name
