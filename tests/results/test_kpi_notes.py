"""Reasons of KPIs without a value, and signals that KPIs took."""

import copy
import math

import pytest

import cosim
from cosim.kpis import time_to_reach
from cosim.results.kpi import NoValue, evaluate_kpis, kpi_notes
from plant_src.kpis import descent, landing, touchdown, waypoints


@pytest.fixture(scope="module")
def flight():
    """Return the start of demo1_box: no landing, no waypoint."""
    return cosim.run("demo1_box", {"/kpis": [], "/checks": [], "/figures": []}, stop_time=2)


def notes(result, name, function, **arguments):
    return kpi_notes(evaluate_kpis(result, [(name, function, arguments)]))


def test_values_with_the_same_reason_share_a_line(flight):
    assert notes(flight, "landing", landing, vehicle="plant.uav", deck="plant.usv.deck") == [
        (
            "landing.time, landing.lateral_error, landing.touchdown_speed and 3 more: plant.uav "
            "touches no vessel after a flight"
        )
    ]
    path = {
        "vehicle": "plant.usv",
        "waypoint_x": [90.0],
        "waypoint_y": [9.0],
        "acceptance_radius": 0.5,
    }
    assert notes(flight, "waypoints", waypoints, **path) == [
        "waypoints.time[1]: plant.usv did not reach this waypoint"
    ]


def test_a_vehicle_that_never_took_off_is_no_vehicle_that_missed_the_vessel():
    """The motors stay off: the quadcopter falls 2 mm onto its platform and stays there."""
    result = cosim.run(
        "demo1_box",
        {"/kpis": [], "/checks": [], "/figures": [], "/connections/2/gain": 0.0},
        stop_time=1,
    )
    deck = {"vehicle": "plant.uav", "deck": "plant.usv.deck"}
    values = evaluate_kpis(
        result,
        [
            ("landing", landing, deck),
            ("touchdown", touchdown, {**deck, "mass": 0.4}),
            ("descent", descent, {"vehicle": "plant.uav", "mode": "uav.mode", "descending": 5}),
        ],
    )
    assert kpi_notes(values) == [
        "landing.time, landing.lateral_error, landing.touchdown_speed and 15 more: "
        "plant.uav never took off, it is in contact during the whole run"
    ]


def test_a_reason_contains_the_values_of_arguments(flight):
    reach = notes(flight, "high", time_to_reach, signal="plant.uav.position.z", level=50.0)
    assert reach == ["high.value: plant.uav.position.z does not reach 50.0"]


def test_a_landing_without_the_mode_of_the_descent_has_another_reason(flight, monkeypatch):
    monkeypatch.setattr("plant_src.kpis.touchdown_row", lambda *_: 10)
    (note,) = notes(flight, "descent", descent, vehicle="plant.uav", mode="uav.mode", descending=9)
    assert note == "descent.time_to_land: uav.mode is never 9, the mode of the descent"


def test_a_function_of_the_user_needs_no_reason(flight):
    assert notes(flight, "own", lambda _: {"a": math.nan}) == ["own.a: the function returned NaN"]
    own = notes(flight, "own", lambda _: {"a": NoValue("no wind")})
    assert own == ["own.a: no wind"]


def test_a_copy_as_for_another_process_has_the_reason():
    value = copy.copy(NoValue("no wind"))
    assert (math.isnan(value), value.reason) == (True, "no wind")


def test_a_run_names_the_signals_of_optional_kpis():
    result = cosim.run("demo1_box", {"/figures": []}, stop_time=0.1)
    assert result.metadata["check_notes"] == [
        (
            "landing.lateral_error, landing.touchdown_speed: plant.uav never took off, it is in "
            "contact during the whole run"
        )
    ]
    assert (
        'descent is computed from the signal uav.mode (argument "mode")'
        in result.metadata["kpi_notes"]
    )
