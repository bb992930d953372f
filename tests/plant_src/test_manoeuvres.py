"""Manoeuvres of MSC.137(76) on tracks whose measures are known in closed form."""

import json
import math

import numpy as np
import pytest

import cosim
from cosim.core import resources
from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import Result
from plant_src.manoeuvres import initial_turning, stopping, turning_circle, zigzag

ORDER, COURSE, LENGTH = 5.003, 0.7, 2.0  # s (between two rows), rad, m
DEGREE = math.pi / 180


def sailed(time, place, heading, speed):
    """A vessel `place` (ahead + i left, m, from the order on the original course), `heading` (rad
    from it), `speed` (m/s).
    """
    world = place * np.exp(1j * COURSE) + (3 - 4j)
    velocity = speed * np.exp(1j * (heading + COURSE))
    columns = {
        "usv.position.x": world.real,
        "usv.position.y": world.imag,
        "usv.attitude.yaw": np.angle(
            np.exp(1j * (heading + COURSE))
        ),  # jumps at pi as the plant's does
        "usv.velocity.x": velocity.real,
        "usv.velocity.y": velocity.imag,
        "usv.velocity_body.u": speed,
    }
    return Result(Recording(time, columns, dict.fromkeys(columns, "")))


def circle(side, turns=2.5, radius=4.0, speed=1.5, later=1.5):
    """Circle with the speed `speed` until one second after the order, then `later` (m/s)."""
    time = np.arange(round(100 * (6 + turns * 2 * math.pi * radius / later)) + 1) / 100
    run = np.where(time < 6, speed * (time - ORDER), speed * (6 - ORDER) + later * (time - 6))
    place = radius * np.sin(run / radius) + 1j * side * radius * (1 - np.cos(run / radius))
    return sailed(time, place, side * run / radius, np.where(time < 6, speed, later))


@pytest.mark.parametrize("side", [1, -1])
def test_a_circle_has_the_measures_of_a_circle(side):
    kpis = turning_circle(circle(side), "usv", ORDER, LENGTH)
    assert kpis == pytest.approx(
        {
            "advance": 4.0,
            "transfer": 4.0,
            "tactical_diameter": 8.0,
            "steady_diameter": 8.0,
            "advance_lengths": 2.0,
            "tactical_diameter_lengths": 4.0,
            "time_to_90": math.pi / 2 * 4.0 / 1.5,
            "time_to_180": math.pi * 4.0 / 1.5,
            "period": 2 * math.pi * 4.0 / 1.5,
            "steady_speed": 1.5,
            "speed_loss": 0.0,
        },
        rel=1e-5,
        abs=1e-5,
    )


def test_speed_loss_refers_to_the_last_full_turn():
    kpis = turning_circle(circle(1, later=0.6), "usv", ORDER, LENGTH)
    assert (kpis["steady_speed"], kpis["speed_loss"], kpis["advance"]) == pytest.approx(
        (0.6, 0.6, 4.0), rel=1e-5
    )


def test_a_measure_that_was_not_reached_is_nan():
    kpis = turning_circle(circle(1, turns=0.2), "usv", ORDER, LENGTH)
    assert kpis["advance"] == pytest.approx(4.0, rel=1e-5)
    unknown = {"tactical_diameter", "tactical_diameter_lengths", "time_to_180"}
    unknown |= {"steady_diameter", "period", "steady_speed", "speed_loss"}
    assert {name for name, value in kpis.items() if math.isnan(value)} == unknown


def test_a_spiral_has_the_diameter_of_its_last_turn():
    """A circle that drifts is not closed: its last turn counts, not its first."""
    time = np.arange(4001) / 100
    angle = np.maximum(time - ORDER, 0)
    radius = np.where(angle < 2 * math.pi, 5.0, 3.0)
    place = np.concatenate(
        [[0], np.cumsum(np.diff(angle) * radius[1:] * np.exp(1j * (angle[1:] + angle[:-1]) / 2))]
    )
    kpis = turning_circle(sailed(time, place, angle, radius), "usv", ORDER, LENGTH)
    assert kpis["steady_diameter"] == pytest.approx(6.0, rel=1e-5)


def zigzags(corners):
    """Headings (degrees from the original course) that are straight lines between `corners` of (s
    after the order, deg).
    """
    times, angles = np.transpose(corners)
    time = np.arange(round(100 * (ORDER + times[-1])) + 1) / 100
    time = np.unique(np.concatenate([time, ORDER + times]))
    heading = np.interp(time - ORDER, times, angles) * DEGREE
    return sailed(time, (time - ORDER).astype(complex), heading, np.ones_like(time))


@pytest.mark.parametrize("side", [1, -1])
def test_the_zig_zag_of_straight_lines(side):
    swings = [(0, 0), (4, side * 14), (9, side * -16), (14, side * 12), (20, side * -13)]
    kpis = zigzag(zigzags(swings), "usv", ORDER)
    executes = [4 * 10 / 14, 4 + 5 * 24 / 30, 9 + 5 * 26 / 28]
    assert kpis == pytest.approx(
        {
            "overshoot[1]": 4 * DEGREE,
            "overshoot[2]": 6 * DEGREE,
            "execute[1]": executes[0],
            "execute[2]": executes[1],
            "initial_turning_time": executes[0],
            "reach": 4 + 5 * 14 / 30,
            "period": executes[2] - executes[0],
        },
        rel=1e-9,
    )


def test_a_wider_zig_zag_counts_its_own_angle():
    kpis = zigzag(
        zigzags([(0, 0), (8, 25), (20, -28), (30, 23)]),
        "usv",
        ORDER,
        angle=20 * DEGREE,
        overshoots=2,
    )
    assert (kpis["overshoot[1]"], kpis["overshoot[2]"]) == pytest.approx((5 * DEGREE, 8 * DEGREE))


def test_an_overshoot_is_nan_until_the_heading_returns():
    kpis = zigzag(zigzags([(0, 0), (4, 14), (9, -16)]), "usv", ORDER)
    assert kpis["overshoot[1]"] == pytest.approx(4 * DEGREE)
    assert math.isnan(kpis["overshoot[2]"])
    assert math.isnan(kpis["period"])
    assert kpis["execute[2]"] == pytest.approx(4 + 5 * 24 / 30)


def test_without_any_turn_all_measures_are_nan():
    assert all(map(math.isnan, zigzag(zigzags([(0, 0), (20, 5)]), "usv", ORDER).values()))


def test_initial_turning_on_a_circle_is_an_arc():
    kpis = initial_turning(circle(-1), "usv", ORDER, LENGTH)
    arc = 10 * DEGREE * 4.0
    assert kpis == pytest.approx(
        {"distance": arc, "distance_lengths": arc / 2, "time": arc / 1.5}, rel=1e-5
    )


def stopping_ship(course=0.5):
    """Decelerates all the time by 0.5 m/s2, with 3 m/s at the order, aslant of its heading; at last
    it goes astern.
    """
    time = np.arange(2001) / 100
    since = time - ORDER
    return sailed(
        time,
        (3 * since - 0.25 * since**2) * np.exp(1j * course),
        np.zeros_like(time),
        3 - 0.5 * since,
    )


def test_a_constant_deceleration_stops_after_half_the_square_of_the_speed():
    kpis = stopping(stopping_ship(), "usv", ORDER, LENGTH)
    expected = {
        "track_reach": 9.0,
        "track_reach_lengths": 4.5,
        "head_reach": 9 * math.cos(0.5),
        "lateral_deviation": 9 * math.sin(0.5),
        "time": 6.0,
    }
    assert kpis == pytest.approx(expected, rel=1e-5)


def test_a_vessel_that_coasts_has_stopped_at_a_speed():
    kpis = stopping(stopping_ship(), "usv", ORDER, LENGTH, speed=1.0)
    assert (kpis["time"], kpis["track_reach"]) == pytest.approx((4.0, 8.0), rel=1e-5)
    assert math.isnan(stopping(stopping_ship(), "usv", ORDER, LENGTH, speed=-9.0)["track_reach"])


def test_an_order_before_the_run_is_refused():
    with pytest.raises(InputError, match="starts at -99 s, before the first recorded row"):
        turning_circle(circle(1), "usv", -99.0, LENGTH)


@pytest.mark.parametrize("manoeuvre", [turning_circle, initial_turning, stopping])
def test_values_are_nan_for_an_order_after_the_end(manoeuvre):
    assert all(math.isnan(value) for value in manoeuvre(circle(1), "usv", 999.0, LENGTH).values())


def test_the_strider_turns_on_the_circle_of_its_speed_and_rate(tmp_path):
    """Named by a scenario; on the last circle the speed is the rate times the radius."""
    root = resources.root()
    turn = {"name": "turn", "python": str(root / "plant_src/manoeuvres.py:turning_circle")}
    content = {
        "name": "circle",
        "stop_time": 60,
        "step_size": 0.01,
        "components": {
            "vessel": {
                "fmu": str(root / "fmus/strider.fmu"),
                "parameters": {"thrust": 2.0, "initial.velocity_body.u": 1.0},
            }
        },
        "events": [{"time": 20.0, "set": {"vessel.rudder_angle": 35 * DEGREE}}],
        "kpis": [{**turn, "arguments": {"vehicle": "vessel", "start": 20.0, "length": 1.0}}],
    }
    (tmp_path / "circle.json").write_text(json.dumps(content))
    result = cosim.run(tmp_path / "circle.json")
    speed = math.hypot(*(result[f"vessel.velocity.{axis}"][-1] for axis in "xy"))
    rate = abs(result["vessel.rates.r"][-1])
    kpis = {name.removeprefix("turn."): value for name, value in result.kpis.items()}
    assert kpis["steady_diameter"] == pytest.approx(2 * speed / rate, rel=1e-3)
    assert kpis["period"] == pytest.approx(2 * math.pi / rate, rel=1e-3)
    assert 0 < kpis["speed_loss"] < 1
    assert kpis["tactical_diameter"] > kpis["transfer"] > 0
    assert result.metadata["kpi_units"]["turn.steady_diameter"] == "m"
