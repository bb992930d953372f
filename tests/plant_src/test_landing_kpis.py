"""KPIs of landing and course keeping, on synthetic motions with known values."""

import math

import numpy as np
import pytest
from mission_recording import DESCENT_RATE, TOUCHDOWN, mission_result, with_signals

from plant_src.kpis import cross_track, descent, landing, touchdown, waypoints

DECK = {"vehicle": "plant.uav", "deck": "plant.usv.deck"}
MASS = 0.42
TIME = mission_result().time
ZERO = np.zeros_like(TIME)


def test_a_level_touchdown():
    kpis = touchdown(mission_result(offset=(0.03, 0.04)), **DECK, mass=MASS)
    assert kpis == pytest.approx(
        {
            "forward_error": 0.03,
            "left_error": 0.04,
            "lateral_error": 0.05,
            "normal_speed": DESCENT_RATE,
            "tangential_speed": 0.1,
            "kinetic_energy": MASS / 2 * (DESCENT_RATE**2 + 0.1**2),
            "tilt": 0.0,
            "deck_roll": 0.0,
            "deck_pitch": 0.0,
            "deck_heave": 0.0,
            "peak_force": 4.1,
        },
        abs=1e-12,
    )


def test_errors_are_those_along_the_deck():
    """The vessel heads north: what is east of the deck's centre is to its right."""
    kpis = touchdown(mission_result(offset=(0.03, 0.04), yaw=math.pi / 2), **DECK, mass=MASS)
    assert (kpis["forward_error"], kpis["left_error"]) == pytest.approx((0.04, -0.03))


def test_speeds_refer_to_the_normal_of_a_rolled_deck():
    """Left side up by 0.2 rad: the normal leans to the right, a fall straight down slides to the
    right.
    """
    falling = mission_result(
        plant__usv__attitude__roll=ZERO + 0.2, plant__uav__velocity__x=ZERO + 1.0
    )
    kpis = touchdown(falling, **DECK, mass=MASS)
    assert kpis["normal_speed"] == pytest.approx(DESCENT_RATE * math.cos(0.2))
    assert kpis["tangential_speed"] == pytest.approx(DESCENT_RATE * math.sin(0.2))
    assert kpis["kinetic_energy"] == pytest.approx(MASS / 2 * DESCENT_RATE**2)
    assert (kpis["tilt"], kpis["deck_roll"]) == pytest.approx((0.2, 0.2))


def test_tilt_is_relative():
    together = mission_result(
        plant__usv__attitude__pitch=ZERO + 0.1, plant__uav__attitude__pitch=ZERO + 0.1
    )
    assert touchdown(together, **DECK, mass=MASS)["tilt"] == pytest.approx(0.0, abs=1e-7)
    crossed = mission_result(
        plant__usv__attitude__roll=ZERO + 0.3, plant__uav__attitude__pitch=ZERO + 0.4
    )
    assert touchdown(crossed, **DECK, mass=MASS)["tilt"] == pytest.approx(
        math.acos(math.cos(0.3) * math.cos(0.4))
    )


def test_a_turning_deck_moves_the_point_below():
    """0.5 m ahead of the centre, a yaw rate of 2 rad/s carries the deck to the left at 1 m/s."""
    turning = mission_result(
        offset=(0.5, 0.0), plant__usv__rates__r=ZERO + 2.0, plant__uav__velocity__x=ZERO + 1.0
    )
    assert touchdown(turning, **DECK, mass=MASS)["tangential_speed"] == pytest.approx(1.0, rel=0.01)


def test_a_pitching_deck_comes_up():
    """Positive pitch rate is nose down: 0.5 m ahead of the centre the deck sinks at 0.1 m/s."""
    pitching = mission_result(
        offset=(0.5, 0.0), plant__usv__rates__q=ZERO + 0.2, plant__uav__velocity__x=ZERO + 1.0
    )
    assert touchdown(pitching, **DECK, mass=MASS)["normal_speed"] == pytest.approx(
        DESCENT_RATE - 0.1, rel=0.01
    )


def test_errors_lie_in_the_plane_of_a_rolled_deck():
    """Left side up by 0.2 rad: a place 0.3 m to the left and as high as the deck rises there is
    that far up the slope.
    """
    rolled = mission_result(
        offset=(0.0, 0.3),
        plant__usv__attitude__roll=ZERO + 0.2,
        plant__uav__position__z=ZERO + 0.27 + 0.3 * math.tan(0.2),
    )
    kpis = touchdown(rolled, **DECK, mass=MASS)
    assert (kpis["left_error"], kpis["lateral_error"]) == pytest.approx(
        (0.3 / math.cos(0.2), 0.3 / math.cos(0.2))
    )


def test_a_vehicle_that_rolls_along_with_the_deck_does_not_slide():
    """0.5 m left of the centre and 0.05 m above the deck, carried along by a deck that heels after
    touchdown.
    """
    roll = 0.3 * np.clip(TIME - TOUCHDOWN, 0, 1)
    carried = mission_result(
        offset=(0.0, 0.0),
        plant__usv__attitude__roll=roll,
        plant__uav__position__y=0.5 * np.cos(roll) - 0.05 * np.sin(roll),
        plant__uav__position__z=0.27 + 0.5 * np.sin(roll) + 0.05 * np.cos(roll),
    )
    assert landing(carried, **DECK)["slide"] == pytest.approx(0.0, abs=1e-12)


def test_heave_is_the_height_above_the_mean():
    heaving = mission_result(
        plant__usv__deck__position__z=0.27 + 0.1 * np.where(TIME >= TOUCHDOWN, 1.0, -1.0)
    )
    mean = 0.1 * np.mean(np.where(TIME >= TOUCHDOWN, 1.0, -1.0))
    assert touchdown(heaving, **DECK, mass=MASS)["deck_heave"] == pytest.approx(0.1 - mean)


def test_the_peak_of_the_force_is_that_after_touchdown():
    hit = np.where(TIME == 0.5, 99.0, np.where(TIME == 12.02, 30.0, 4.1))
    assert (
        touchdown(mission_result(plant__uav__contact__force=hit), **DECK, mass=MASS)["peak_force"]
        == 30.0
    )


def test_without_a_touchdown_all_kpis_are_nan():
    flying = mission_result(plant__uav__contact__vessel=ZERO > 0)
    kpis = touchdown(flying, **DECK, mass=MASS)
    assert kpis.keys() == touchdown(mission_result(), **DECK, mass=MASS).keys()
    assert all(math.isnan(value) for value in kpis.values())


def test_time_to_land_counts_from_the_first_descent():
    assert descent(mission_result(), "plant.uav", "uav.vtol.mode", 5) == {
        "time_to_land": pytest.approx(TOUCHDOWN - 9.0),
        "aborts": 0,
    }


def test_aborts_are_changes_to_a_lower_mode():
    modes = mission_result()["uav.vtol.mode"].copy()
    modes[(TIME >= 9.5) & (TIME < 10)] = 4
    modes[(TIME >= 10.5) & (TIME < 11)] = 3
    kpis = descent(mission_result(uav__vtol__mode=modes), "plant.uav", "uav.vtol.mode", 5)
    assert kpis == {"time_to_land": pytest.approx(TOUCHDOWN - 9.0), "aborts": 2}


def test_without_a_descent_there_is_no_time_to_land():
    never = mission_result(uav__vtol__mode=np.ones_like(TIME, dtype=int))
    kpis = descent(never, "plant.uav", "uav.vtol.mode", 5)
    assert (math.isnan(kpis["time_to_land"]), kpis["aborts"]) == (True, 0)


def sailing(x, y):
    return mission_result(plant__usv__position__x=x, plant__usv__position__y=y)


def test_on_the_line_there_is_no_cross_track_error():
    kpis = cross_track(sailing(TIME, 0.5 * TIME), "plant.usv", [4.0, 10.0], [2.0, 5.0], 0.1)
    assert kpis == pytest.approx({"rms": 0, "max": 0, "leg[1]": 0, "leg[2]": 0}, abs=1e-12)


def test_cross_track_error_is_the_distance_from_each_leg():
    """East along y = 0 with a bulge of 0.3 m, then north along x = 5, off by 0.2 m."""
    east = TIME < 10
    x = np.where(east, 0.5 * TIME, 5.2)
    y = np.where(east, 0.3 * np.sin(np.pi * TIME / 10), 0.5 * (TIME - 10))
    kpis = cross_track(sailing(x, y), "plant.usv", [5.0, 5.0], [0.0, 4.0], 0.15)
    assert (kpis["leg[1]"], kpis["leg[2]"], kpis["max"]) == pytest.approx((0.3, 0.2, 0.3), abs=0.01)
    assert 0.2 < kpis["rms"] < 0.22


def test_distances_are_those_on_either_side():
    for side in (1, -1):
        y = np.where(TIME > 1, side * 0.4, 0.0)
        assert cross_track(sailing(TIME, y), "plant.usv", [10.0], [0.0], 0.5)[
            "max"
        ] == pytest.approx(0.4)


def test_a_leg_that_is_not_finished_lasts_to_the_end_and_the_next_is_not_begun():
    away = sailing(TIME, np.where(TIME > 19.5, 7.0, 0.0))
    kpis = cross_track(away, "plant.usv", [100.0, 200.0], [0.0, 0.0], 0.5)
    assert kpis["leg[1]"] == kpis["max"] == 7.0
    assert math.isnan(kpis["leg[2]"])
    assert waypoints(away, "plant.usv", [100.0], [0.0], 0.5)["reached"] == 0


def test_rows_after_the_last_waypoint_do_not_count():
    past = sailing(TIME, np.where(TIME > 10.5, 9.0, 0.0))
    assert cross_track(past, "plant.usv", [10.0], [0.0], 0.5)["max"] == 0.0


def test_a_start_on_the_first_waypoint_is_a_leg_too():
    still = with_signals(
        mission_result(), plant__usv__position__x=ZERO, plant__usv__position__y=ZERO
    )
    assert cross_track(still, "plant.usv", [0.0], [0.0], 0.5)["max"] == 0.0
