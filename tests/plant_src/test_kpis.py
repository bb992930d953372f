"""KPIs of a mission, on a synthetic result with known values."""

import math

import numpy as np
import pytest
from mission_recording import DESCENT_RATE, STOP, TAKE_OFF, TOUCHDOWN, mission_result, with_signals

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.kpi import evaluate_kpis
from plant_src.kpis import final, landing, motors, tracking, waypoints

DECK = {"vehicle": "plant.uav", "deck": "plant.usv.deck"}
TIME = mission_result().time


def contacts(*spans):
    """Contact with the vessel in these time spans, after a start on the platform."""
    vessel = np.any([(start <= TIME) & (stop > TIME) for start, stop in spans], axis=0)
    return {
        "plant__uav__contact__vessel": vessel,
        "plant__uav__contact__touching": vessel | (TIME < TAKE_OFF),
    }


def test_landing_is_evaluated_at_the_touchdown():
    kpis = landing(mission_result(offset=(0.03, 0.04)), **DECK)
    assert kpis == pytest.approx(
        {
            "time": TOUCHDOWN,
            "lateral_error": 0.05,
            "touchdown_speed": DESCENT_RATE,
            "tangential_speed": 0.1,
            "slide": 0.0,
            "bounces": 0,
            "landed_at_end": True,
            "final_lateral_error": 0.05,
        },
        abs=1e-12,
    )


def test_touchdown_speed_is_relative_to_a_heaving_deck():
    heaving = mission_result(plant__usv__deck__velocity__z=np.full_like(TIME, 0.2))
    assert landing(heaving, **DECK)["touchdown_speed"] == pytest.approx(DESCENT_RATE + 0.2)


def test_without_a_landing_all_kpis_are_nan():
    kpis = landing(mission_result(**contacts()), **DECK)
    assert (kpis.pop("bounces"), kpis.pop("landed_at_end")) == (0, False)
    assert all(math.isnan(value) for value in kpis.values())
    assert kpis.keys() == landing(mission_result(), **DECK).keys() - {"bounces", "landed_at_end"}


def test_waiting_on_the_deck_is_no_landing():
    waiting = mission_result(**contacts((0.0, STOP + 1)))
    assert math.isnan(landing(waiting, **DECK)["time"])
    assert landing(waiting, **DECK)["landed_at_end"] is False


def test_a_start_just_above_the_deck_is_no_landing():
    dropped = with_signals(
        mission_result(**contacts((0.03, STOP + 1))), plant__uav__contact__touching=TIME >= 0.03
    )
    assert math.isnan(landing(dropped, **DECK)["time"])


def test_leaving_the_deck_and_returning_is_a_landing():
    back = mission_result(**contacts((0.0, 2.0), (7.0, STOP + 1)))
    assert landing(back, **DECK)["time"] == 7.0


def test_a_start_in_the_air_can_land():
    flying = mission_result(plant__uav__contact__touching=TIME >= TOUCHDOWN)
    assert landing(flying, **DECK)["time"] == TOUCHDOWN


def test_bounces_are_counted():
    bouncing = mission_result(**contacts((12.0, 12.1), (12.2, 12.3), (12.35, STOP + 1)))
    assert landing(bouncing, **DECK)["bounces"] == 2


def test_leaving_for_good_is_not_landed_at_the_end():
    kpis = landing(mission_result(**contacts((12.0, 15.0))), **DECK)
    assert (kpis["landed_at_end"], kpis["bounces"]) == (False, 0)
    assert math.isnan(kpis["final_lateral_error"])
    assert kpis["lateral_error"] == pytest.approx(0.05)


def carried(yaw, forward, left):
    """A quadcopter on a rotating deck, at this position in the vessel's axes."""
    x, y = forward * np.cos(yaw) - left * np.sin(yaw), forward * np.sin(yaw) + left * np.cos(yaw)
    places = {"plant__uav__position__x": TIME + x, "plant__uav__position__y": y}
    return mission_result(yaw=yaw, **places)


def test_a_turning_deck_carries_without_a_slide():
    turning = carried(yaw=0.5 * TIME, forward=0.2, left=-0.1)
    assert landing(turning, **DECK)["slide"] == pytest.approx(0.0, abs=1e-12)


def test_slide_is_the_largest_distance_on_the_deck():
    there_and_back = 0.03 * np.clip(TIME - 13, 0, 1) - 0.02 * np.clip(TIME - 15, 0, 1)
    sliding = carried(yaw=0.5 * TIME, forward=0.1 + there_and_back, left=0.0)
    assert landing(sliding, **DECK)["slide"] == pytest.approx(0.03)


def test_motion_after_leaving_the_deck_is_not_a_slide():
    away = carried(yaw=0.0 * TIME, forward=0.1 + np.maximum(0, TIME - 15), left=0.0)
    assert landing(with_signals(away, **contacts((12.0, 15.0))), **DECK)["slide"] == pytest.approx(
        0.0, abs=1e-12
    )


def test_a_result_from_its_file_has_the_same_kpis(tmp_path):
    mission_result().to_csv(tmp_path / "result.csv")
    assert landing(Result.from_csv(tmp_path / "result.csv"), **DECK) == landing(
        mission_result(), **DECK
    )


def test_waypoints_are_reached_one_after_the_other():
    kpis = waypoints(
        mission_result(),
        "plant.usv",
        waypoint_x=[5.0, 10.0],
        waypoint_y=[0.29, 0.0],
        acceptance_radius=0.5,
    )
    assert kpis == {"reached": 2, "all_reached": True, "time[1]": 4.6, "time[2]": 9.5}


def test_a_waypoint_out_of_order_does_not_count():
    kpis = waypoints(
        mission_result(),
        "plant.usv",
        waypoint_x=[10.0, 5.0, 15.0],
        waypoint_y=[0.0, 0.0, 0.0],
        acceptance_radius=0.5,
    )
    assert (kpis["reached"], kpis["all_reached"], kpis["time[1]"]) == (1, False, 9.5)
    assert math.isnan(kpis["time[2]"])
    assert math.isnan(kpis["time[3]"])


def test_a_waypoint_out_of_reach_is_not_reached():
    kpis = waypoints(
        mission_result(), "plant.usv", waypoint_x=[5.0], waypoint_y=[0.6], acceptance_radius=0.5
    )
    assert (kpis["reached"], kpis["all_reached"]) == (0, False)


def test_tracking_is_the_distance_in_its_window():
    swinging = mission_result(
        plant__uav__position__x=TIME, plant__uav__position__y=0.4 * np.sin(2 * np.pi * TIME)
    )
    kpis = tracking(swinging, "plant.uav", "plant.usv", start=8.0, stop=11.99)
    assert kpis == pytest.approx({"rms": 0.4 / math.sqrt(2), "max": 0.4}, rel=1e-12)


def test_tracking_lasts_until_the_end_and_leaves_the_start_out():
    assert tracking(
        mission_result(offset=(0.0, 0.2)), "plant.uav", "plant.usv", start=9.0
    ) == pytest.approx({"rms": 0.2, "max": 0.2})
    assert (
        tracking(mission_result(offset=(0.0, 0.2)), "plant.uav", "plant.usv", start=0.0)["max"]
        > 5.0
    )


def test_tracking_in_an_empty_window_is_nan():
    assert all(
        math.isnan(value)
        for value in tracking(mission_result(), "plant.uav", "plant.usv", start=99.0).values()
    )


def test_motors_stop_when_the_last_of_them_does():
    late = mission_result(**{"uav__rotor_speed[3]": np.where(TIME < 12.5, 500.0, 0.0)})
    kpis = motors(late, "uav.rotor_speed")
    assert kpis == {
        "stopped_at_end": True,
        "stop_time": 12.5,
        "final_speed": 0.0,
        "max_speed": 500.0,
    }


def test_motors_that_start_again_have_not_stopped():
    again = mission_result(
        **{"uav__rotor_speed[2]": np.where((TIME > 13) & (TIME < 19.99), 0.0, 300.0)}
    )
    kpis = motors(again, "uav.rotor_speed")
    assert (kpis["stopped_at_end"], kpis["final_speed"]) == (False, 300.0)
    assert math.isnan(kpis["stop_time"])


def test_motors_that_never_ran_stopped_at_the_start():
    idle = mission_result(**{f"uav__rotor_speed[{i}]": np.zeros_like(TIME) for i in range(1, 5)})
    assert motors(idle, "uav.rotor_speed")["stop_time"] == 0.0


def test_motor_commands_are_converted_from_their_unit():
    names = [f"uav.rotor_speed[{i}]" for i in (1, 2)]
    commands = {names[0]: np.array([6000.0, 3000.0, 5.0]), names[1]: np.array([0.0, 628.0, 0.9])}
    recorded = Recording(np.array([0.0, 1.0, 2.0]), commands, {names[0]: "rpm", names[1]: "rad/s"})
    kpis = motors(Result(recorded), "uav.rotor_speed")
    assert kpis["max_speed"] == pytest.approx(200 * np.pi, rel=1e-12)  # 6000 revolutions per minute
    assert (kpis["stopped_at_end"], kpis["stop_time"], kpis["final_speed"]) == (True, 2.0, 0.9)
    in_newtons = Recording(recorded.time, commands, dict.fromkeys(names, "N"))
    with pytest.raises(
        InputError, match=r'"uav.rotor_speed\[1\]" has the unit N, which does not convert to rad/s'
    ):
        motors(Result(in_newtons), "uav.rotor_speed")


def test_unknown_signal_names_are_rejected():
    with pytest.raises(
        InputError,
        match=r'KPI "landing": no signal "plant.uva.contact.vessel" .* "plant.uav.contact.vessel"',
    ):
        evaluate_kpis(mission_result(), [("landing", landing, {**DECK, "vehicle": "plant.uva"})])
    with pytest.raises(InputError, match=r'KPI "motors": no signal "uav.rotors\[1\]"'):
        evaluate_kpis(mission_result(), [("motors", motors, {"rotor_speed": "uav.rotors"})])


def test_the_final_value_of_a_signal():
    assert final(mission_result(), "plant.uav.position.z") == {
        "value": mission_result()["plant.uav.position.z"][-1]
    }


@pytest.mark.parametrize(
    ("x", "y", "radius", "message"),
    [
        ([0.0, 1.0], [0.0], 2.0, "expected as many waypoint_x as waypoint_y; found 2 and 1"),
        ([0.0], [0.0], -2.0, r"expected a positive acceptance_radius \(m\); found -2"),
    ],
)
def test_implausible_arguments_are_refused(x, y, radius, message):
    with pytest.raises(InputError, match=message):
        waypoints(mission_result(), "plant.usv", x, y, radius)
