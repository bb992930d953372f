"""Warnings about inputs that were outside the limits of their component for a long part of a run."""

import cosim

QUIET = {"/kpis": [], "/checks": [], "/figures": [], "/stop_when": []}


def warnings(caplog, settings):
    cosim.run("demo1_box", {**QUIET, **settings}, stop_time=4)
    return [message for message in caplog.messages if "limits" in message]


def test_commands_within_the_limits_cause_no_warning(caplog):
    assert warnings(caplog, {}) == []


def test_rotor_speeds_in_rpm(caplog):
    """The controller gives rad/s; 30 / pi makes rpm of them, which the quadcopter limits to full thrust."""
    (line,) = warnings(caplog, {"/connections/2/gain": 9.5492966})
    assert line.startswith("plant.uav.rotor_speed[4] (and 3 more elements) is outside its limits 0 ... 523.6 rad/s in ")
    assert " % of the run, up to " in line
    assert "; probable cause: rpm in place of rad/s (" in line


def test_a_rudder_angle_in_degrees(caplog):
    (line,) = warnings(caplog, {"/connections/5/gain": 57.29578})
    assert line.startswith("plant.usv.rudder_angle is outside its limits -1.571 ... 1.571 rad in 100 % of the run, up to -35 rad")
    assert line.endswith("; probable cause: deg in place of rad (-35 deg = -0.6109 rad)")


def test_a_wrong_sign_and_an_unknown_cause(caplog):
    (line,) = warnings(caplog, {"/connections/2/gain": -1.0})
    assert line.endswith("; probable cause: the sign")
    caplog.clear()
    (line,) = warnings(caplog, {"/connections/2/gain": 1e4})
    assert line.endswith("; probable causes: another unit than rad/s, or gains of the controller that are too large")


def test_a_signal_that_is_recorded_by_the_name_of_a_port_suffices(caplog):
    (line,) = warnings(caplog, {"/connections/2/gain": 9.5492966, "/record/signals": ["uav.rotor_speed*"]})
    assert line.startswith("plant.uav.rotor_speed[4] (and 3 more elements)")
    caplog.clear()
    assert warnings(caplog, {"/connections/2/gain": 9.5492966, "/record/signals": ["usv.*"]}) == []
