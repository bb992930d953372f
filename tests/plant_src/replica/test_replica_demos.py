"""Demos of the published simulator against an independent re-simulation."""

from __future__ import annotations

import numpy as np
import pytest
from plant_validation import MeasurementCheck

import cosim
from cosim.results import Result

REPLICA, AGAIN = "Replica of the published simulator", "independent re-simulation"


@pytest.fixture(scope="module")
def box() -> Result:
    return cosim.run("demo1_replica")


@pytest.fixture(scope="module")
def sweep() -> Result:
    return cosim.run("demo2_replica")


def distance(result: Result) -> np.ndarray:
    x, y = (
        result[f"plant.uav.position.{axis}"] - result[f"plant.usv.position.{axis}"] for axis in "xy"
    )
    return np.hypot(x, y)


@pytest.mark.parametrize(
    ("waypoint", "time"), list(enumerate([5.5, 15.3, 22.5, 29.8, 36.3], start=1))
)
def test_the_box_is_sailed_in_time(
    box: Result, waypoint: int, time: float, measured: MeasurementCheck
) -> None:
    found, case = box.kpis[f"waypoints.time[{waypoint}]"], f"waypoint {waypoint}"
    measured(REPLICA, "box pattern", found, time, "s", AGAIN, within=0.2, case=case)


@pytest.mark.parametrize(
    ("leg", "overshoot"), list(enumerate([0.94, 1.97, 1.01, 1.11, 1.59], start=1))
)
def test_overshoots_of_the_box_equal_the_reference(
    box: Result, leg: int, overshoot: float, measured: MeasurementCheck
) -> None:
    found, case = box.kpis[f"overshoots.leg[{leg}]"], f"leg {leg}"
    measured(REPLICA, "overshoots of the box", found, overshoot, "m", AGAIN, within=0.1, case=case)


def test_the_extent_of_the_box_equals_the_reference(box: Result) -> None:
    x, y = (box[f"plant.usv.position.{axis}"] for axis in "xy")
    assert [x.min(), x.max(), y.min(), y.max()] == pytest.approx(
        [-4.44, 5.30, -4.34, 4.22], abs=0.1
    )


def test_the_vessel_keeps_its_speed(sweep: Result, measured: MeasurementCheck) -> None:
    straight = (sweep.time > 15) & (sweep.time < 20)
    speed = sweep["plant.usv.velocity.x"][straight].mean()
    measured(
        REPLICA, "mean speed of the vessel on a sweep", speed, 0.9988, "m/s", AGAIN, within=1e-3
    )


def test_the_yaw_rate_of_the_vessel_equals_the_reference(
    box: Result, measured: MeasurementCheck
) -> None:
    rate = np.abs(box["plant.usv.angular_velocity.z"]).max()
    measured(REPLICA, "largest yaw rate in the box", rate, 1.28, "rad/s", AGAIN, relative=0.03)


def test_the_approach_dips_and_ends_on_the_deck(box: Result, measured: MeasurementCheck) -> None:
    lowest, time, speed, error = (
        box.kpis[f"touchdown.{name}"] for name in ("lowest", "time", "speed", "error")
    )
    measured(REPLICA, "lowest height of the approach", lowest, 0.854, "m", AGAIN, within=0.03)
    measured(REPLICA, "touchdown", time, 13.06, "s", AGAIN, within=0.1)
    measured(REPLICA, "its speed", speed, 1.16, "m/s", AGAIN, relative=0.2)
    measured(REPLICA, "its distance from the deck's centre", error, 0.077, "m", AGAIN, relative=0.2)


def test_landing_is_commanded_half_a_second_earlier(box: Result) -> None:
    commanded = box.time[(box["uav.altitude_reference"] == 0) & (box.time > 5)]
    assert commanded[0] == pytest.approx(12.56, abs=0.1)


def test_the_first_sample_of_the_controllers_is_zero(box: Result) -> None:
    """The first inputs of the controllers are zero, although the plant is elsewhere."""
    assert box["plant.uav.position.z"][0] == pytest.approx(0.725)
    assert box["uav.horizontal_error"][0] == 0


def test_controllers_act_on_the_sample_before(box: Result) -> None:
    """The published value of a row was computed one step earlier, from the state of the plant
    another step before.
    """
    np.testing.assert_allclose(box["uav.horizontal_error"][2:], distance(box)[:-2], atol=1e-12)


@pytest.mark.parametrize(("waypoint", "time"), list(enumerate([20.4, 41.3, 52.2], start=1)))
def test_the_sweep_is_sailed_in_time(
    sweep: Result, waypoint: int, time: float, measured: MeasurementCheck
) -> None:
    found, case = sweep.kpis[f"waypoints.time[{waypoint}]"], f"waypoint {waypoint}"
    measured(REPLICA, "sweep pattern", found, time, "s", AGAIN, within=0.3, case=case)


@pytest.mark.parametrize(("leg", "overshoot"), list(enumerate([0.01, 1.65, 1.39], start=1)))
def test_overshoots_of_the_sweep_equal_the_reference(
    sweep: Result, leg: int, overshoot: float
) -> None:
    assert sweep.kpis[f"overshoots.leg[{leg}]"] == pytest.approx(overshoot, abs=0.05)


def test_straight_legs_are_followed_within_8_millimetres(sweep: Result) -> None:
    assert sweep.kpis["tracking.straight"] < 0.008


def test_tracking_peaks_in_turns_equal_the_reference(sweep: Result) -> None:
    assert 0.39 <= sweep.kpis["tracking.least_turn"] <= sweep.kpis["tracking.turn"] <= 0.48


@pytest.mark.parametrize("waypoint", [1, 2, 3])
def test_a_turn_is_over_after_5_6_seconds(sweep: Result, waypoint: int) -> None:
    switch = sweep.kpis[f"waypoints.time[{waypoint}]"]
    off = sweep.time[(distance(sweep) > 0.1) & (sweep.time > switch) & (sweep.time < switch + 8)]
    assert off.max() - switch == pytest.approx(5.6, abs=0.2)


def test_the_vessel_is_caught_up_with_in_time(sweep: Result) -> None:
    off = sweep.time[(distance(sweep) > 0.1) & (sweep.time < 20)]
    assert off.max() == pytest.approx(6.9, abs=0.1)


def test_the_sweep_ends_hovering_at_the_approach_height(sweep: Result) -> None:
    assert sweep["plant.uav.position.z"][-500:] == pytest.approx(1.0, abs=0.05)


def test_without_landing_the_box_is_followed_as_well() -> None:
    """From 8 s until the last waypoint: rms 0.30 m, mean 0.23 m, at most 0.72 m."""
    result = cosim.run("demo1_replica", stop_time=36.4, parameters={"uav.vtol.enabled": 0.0})
    off = distance(result)[result.time > 8]
    assert [np.sqrt(np.mean(off**2)), off.mean(), off.max()] == pytest.approx(
        [0.30, 0.23, 0.72], rel=0.03
    )


def test_on_a_straight_course_it_lands_earlier() -> None:
    result = cosim.run("demo2_replica", stop_time=8.0, parameters={"uav.vtol.landing_error": 0.1})
    down = np.flatnonzero((result["plant.uav.position.z"] < 0.33) & (result.time > 5))[0]
    assert result.time[down] == pytest.approx(7.32, abs=0.05)
    assert result["plant.uav.velocity.z"][down - 1] == pytest.approx(-1.39, rel=0.2)


def test_on_a_vessel_at_rest_it_lands_earlier_still() -> None:
    """Started at 2 m near the vessel, where the approach altitude is the last thing to wait for."""
    start = {"/components/plant/arguments/vehicles/uav/position": [-2.1, 0.075, 2.0]}
    result = cosim.run(
        "demo1_replica", stop_time=8.0, parameters={"usv.autopilot.speed_command": 0.0, **start}
    )
    late = result.time > 5
    commanded = np.flatnonzero((result["uav.altitude_reference"] == 0) & late)[0]
    down = np.flatnonzero((result["plant.uav.position.z"] < 0.33) & late)[0]
    assert result.time[[commanded, down]] == pytest.approx([5.62, 6.04], abs=0.02)
    assert result["plant.uav.velocity.z"][down - 1] == pytest.approx(-1.54, rel=0.05)


def test_with_the_nose_elsewhere_world_velocities_make_it_diverge() -> None:
    """The published flaw: 14 m off after 6 s, 19 m after 9 s."""
    result = cosim.run("demo1_replica", stop_time=9.0, parameters={"uav.psi_command": -np.pi / 2})
    off = distance(result)
    assert [off[600], off[900]] == pytest.approx([14, 19], rel=0.03)


def test_with_the_physical_rudder_other_gains_sail_the_box_in_38_seconds() -> None:
    changes = {
        "usv.rudder_inflow_sign": -1.0,
        "usv.autopilot.heading.P": 1.5,
        "usv.autopilot.heading.D": 0.8,
    }
    assert cosim.run("demo1_replica", parameters=changes).kpis[
        "waypoints.time[5]"
    ] == pytest.approx(38.0, abs=0.1)


def test_with_the_physical_rudder_and_the_published_gains_it_sails_far_off() -> None:
    result = cosim.run(
        "demo1_replica",
        stop_time=46.0,
        parameters={"usv.rudder_inflow_sign": -1.0, "uav.vtol.enabled": 0.0},
    )
    assert result.kpis["waypoints.time[5]"] == pytest.approx(45.6, abs=0.1)
    assert max(result.kpis[f"overshoots.leg[{leg}]"] for leg in range(1, 6)) == pytest.approx(
        3.5, abs=0.1
    )


def test_with_one_hull_it_then_circles_round_a_waypoint() -> None:
    changes = {"usv.rudder_inflow_sign": -1.0, "usv.hulls": 1.0, "uav.vtol.enabled": 0.0}
    assert (
        cosim.run("demo1_replica", stop_time=40.0, parameters=changes).kpis["waypoints.reached"]
        == 0
    )
