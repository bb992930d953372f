"""Warnings about inputs that were outside their limits for a long part of a run."""

import json
import math
import re

import pytest

import cosim
from cosim.scenario import load
from cosim.scenario.input_limits import probable_cause
from cosim.scenario.plausibility import find_warnings

QUIET = {"/kpis": [], "/checks": [], "/figures": [], "/stop_when": []}


def warnings(caplog, settings):
    cosim.run("demo1_box", {**QUIET, **settings}, stop_time=4)
    return [message for message in caplog.messages if "limits" in message]


def test_commands_within_the_limits_cause_no_warning(caplog):
    assert warnings(caplog, {}) == []


def test_rotor_speeds_in_rpm(caplog):
    """The controller gives rad/s; 30 / pi makes rpm of them, which the quadcopter limits to full
    thrust.
    """
    (line,) = warnings(caplog, {"/connections/2/gain": 9.5492966})
    assert line.startswith(
        "plant.uav.rotor_speed[4] (and 3 more elements) is outside its limits 0 ... 523.6 rad/s in "
    )
    assert " % of the run, up to " in line
    assert "; probable cause: rpm in place of rad/s (" in line


def test_a_rudder_angle_in_degrees(caplog):
    (line,) = warnings(caplog, {"/connections/5/gain": 57.29578})
    assert line.startswith(
        "plant.usv.rudder_angle is outside its limits -1.571 ... 1.571 rad in 100 % of the run, up "
        "to -35 rad"
    )
    assert line.endswith("; probable cause: deg in place of rad (-35 deg = -0.6109 rad)")


def test_a_wrong_sign_and_an_unknown_cause(caplog):
    (line,) = warnings(caplog, {"/connections/2/gain": -1.0})
    assert line.endswith("; probable cause: the sign")
    caplog.clear()
    (line,) = warnings(caplog, {"/connections/2/gain": 1e4})
    assert line.endswith(
        "; probable cause: the controller saturates, or a value of the vehicle is wrong"
    )


@pytest.mark.parametrize(
    ("value", "unit", "limit", "is_named"),
    [
        (1389, "rad/s", 150, True),
        (182.8, "rad/s", 150, False),
        (35, "rad", math.pi / 2, True),
        (2, "rad", 0.6, False),
    ],
)
def test_another_unit_is_named_if_the_converted_value_is_near_the_limit(
    value, unit, limit, is_named
):
    """182.8 rpm are only 19 of 150 rad/s: nobody commands that, but a controller that saturates
    exceeds the limit by 22 %.
    """
    for sign in (1, -1):
        assert (
            "in place of" in probable_cause(sign * value, (-limit, limit), unit, "?")
        ) == is_named


BOAT = {
    "name": "trial",
    "stop_time": 1,
    "step_size": 0.01,
    "components": {
        "plant": {
            "python": "cosim:plant_src/world.py:World",
            "arguments": {"vehicles": {"boat": {"model": "blueboat", "position": [0, 0]}}},
        }
    },
    "connections": [],
    "record": {"signals": ["plant.boat.position.*"]},
}
RPM = [1200.0, 1200.0]


def set_warnings(tmp_path, settings, **keys):
    (file := tmp_path / "trial.json").write_text(json.dumps({**BOAT, **keys}, indent=1))
    prepared = load(file, settings)
    try:
        return [str(each) for each in find_warnings(prepared) if "limits" in each.message]
    finally:
        prepared.free()


def test_a_command_beyond_the_limits_is_named_when_the_scenario_is_read(tmp_path):
    """The input is not recorded; events, parameters and settings are named with their place, and
    once.
    """
    event = {"time": 0, "set": {"plant.boat.propeller_speed": RPM}}
    (line,) = set_warnings(tmp_path, {}, events=[event, {**event, "time": 0.5}])
    assert re.search(
        (
            r"trial.json:\d+:\d+: \$.events\[0\]: plant.boat.propeller_speed\[1\] \(and 1 more "
            r"element\) is set to 1200"
        ),
        line,
    )
    assert "; probable cause: rpm in place of rad/s (1200 rpm = 125.7 rad/s)" in line
    assert line.endswith(" (and 1 further value)")
    plant = {**BOAT["components"]["plant"], "parameters": {"boat.propeller_speed": RPM}}
    (line,) = set_warnings(tmp_path, {}, components={"plant": plant})
    assert ": $.components.plant.parameters" in line
    (line,) = set_warnings(tmp_path, {"plant.boat.propeller_speed": RPM})
    assert line.startswith('setting "plant.boat.propeller_speed": ')
    assert set_warnings(tmp_path, {"plant.boat.propeller_speed": [100.0, 100.0]}) == []


def test_a_set_command_is_named_once_after_the_run(tmp_path, caplog):
    event = {"time": 0, "set": {"plant.boat.propeller_speed": RPM}}
    (file := tmp_path / "trial.json").write_text(
        json.dumps(
            {**BOAT, "events": [event], "record": {"signals": ["plant.boat.propeller_speed*"]}}
        )
    )
    cosim.run(file)
    (line,) = [message for message in caplog.messages if "limits" in message]
    assert "$.events[0]: plant.boat.propeller_speed[1]" in line


def test_a_signal_that_is_recorded_by_the_name_of_a_port_suffices(caplog):
    (line,) = warnings(
        caplog, {"/connections/2/gain": 9.5492966, "/record/signals": ["uav.rotor_speed*"]}
    )
    assert line.startswith("plant.uav.rotor_speed[4] (and 3 more elements)")
    caplog.clear()
    assert warnings(caplog, {"/connections/2/gain": 9.5492966, "/record/signals": ["usv.*"]}) == []
