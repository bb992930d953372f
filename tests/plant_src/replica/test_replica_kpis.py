"""KPIs of the replica on synthetic motions whose values are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cosim.core.recording import Recording
from cosim.results import Result
from plant_src.replica.kpis import overshoots, touchdown, turns

TIME = np.arange(3001) / 100
COURSE = {"waypoint_x": [10.0, 10.0], "waypoint_y": [0.0, 10.0], "acceptance_radius": 0.5}


def result(**columns: np.ndarray) -> Result:
    """Signals of the plant; "__" in names stands for the dot."""
    return Result(
        Recording(
            TIME,
            {f"plant.{name.replace('__', '.')}": values for name, values in columns.items()},
            {},
        )
    )


def vessel() -> dict[str, np.ndarray]:
    """1 m/s along x to (12, 0), which is past the first waypoint, then back and up to (10, 10) at
    22 s or so.
    """
    corners = np.array([[0, 0], [12, 0], [12, 6], [10, 10], [10, 20]])
    at = np.concatenate(([0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
    return {
        f"usv__position__{axis}": np.interp(TIME, at, column)
        for axis, column in zip("xy", corners.T, strict=True)
    }


def test_an_overshoot_is_the_largest_distance_from_the_line_of_a_leg() -> None:
    legs = overshoots(result(**vessel()), "plant.usv", **COURSE)
    assert legs == pytest.approx({"leg[1]": 0.0, "leg[2]": 2.0}, abs=1e-9)


def test_a_leg_that_is_not_finished_has_no_overshoot() -> None:
    legs = overshoots(
        result(**vessel()),
        "plant.usv",
        waypoint_x=[10.0, 50.0],
        waypoint_y=[0.0, 0.0],
        acceptance_radius=0.5,
    )
    assert legs["leg[1]"] == pytest.approx(0.0)
    assert math.isnan(legs["leg[2]"])


def test_turns_and_straight_legs_are_evaluated_separately() -> None:
    """The waypoints are reached at 9.5 s and 22 s."""
    target = vessel()
    off = np.select([TIME < 4, (TIME > 10) & (TIME < 11), TIME > 22.5], [3.0, 0.4, 0.2], 0.01)
    uav = {
        name.replace("usv", "uav"): values + off * (name[-1] == "x")
        for name, values in target.items()
    }
    kpis = turns(result(**target, **uav), "plant.uav", "plant.usv", **COURSE, settling=9.0)
    assert kpis == pytest.approx({"straight": 0.01, "turn": 0.4, "least_turn": 0.2})


def landing(start: float) -> dict[str, float]:
    """Down at 0.5 m/s from 3 m on, resting at 0.3255 m from 5.349 s on, beside a vessel at rest; a
    dive to 0 m before 1 s.
    """
    zero = np.zeros_like(TIME)
    z = np.where(TIME < 1, 0.0, np.maximum(0.3255, 3 - 0.5 * TIME))
    vertical = np.where(z > 0.3255, -0.5, 0.0)
    columns = {
        "uav__position__x": zero + 0.03,
        "uav__position__y": zero + 0.04,
        "uav__position__z": z,
    }
    vessel_at_rest = {"usv__position__x": zero, "usv__position__y": zero}
    return touchdown(
        result(**columns, uav__velocity__z=vertical, **vessel_at_rest),
        "plant.uav",
        "plant.usv",
        0.3255,
        start,
    )


def test_a_touchdown_is_found_by_the_altitude() -> None:
    expected = {"time": 5.34, "error": 0.05, "speed": 0.5, "lowest": 3 - 0.5 * 4.83}
    assert landing(start=2.0) == pytest.approx(expected, abs=1e-9)


def test_a_descent_before_the_start_is_not_a_landing() -> None:
    assert landing(start=0.0)["time"] == 0.0


def test_all_values_are_nan_without_a_touchdown() -> None:
    high = np.full_like(TIME, 2.0)
    kpis = touchdown(result(uav__position__z=high), "plant.uav", "plant.usv", 0.3255, 5.0)
    assert all(math.isnan(value) for value in kpis.values())
