"""Wave loads: limits of long and short waves, and the elementary functions."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from catamaran_reference import AREA, BEAM, BOX_DRAUGHT, POINTS, water_at
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation
from world_harness import WorldHarness, vessel_settings

from plant_src.environment import sea
from plant_src.environment.sea import Sea
from plant_src.vehicles.common import elementary_functions
from plant_src.vehicles.strider_6dof import parameters as p
from plant_src.vehicles.vessel import strips
from plant_src.vehicles.vessel import strips as wave_loads

VESSELS = [
    {"model": "strider", "motion": "6dof"},
    {"model": "otter", "parameters": {"payload_mass": 0.0}},
]


def swell(height: float, period: float, direction: float = 0.0) -> dict[str, Any]:
    """Nearly regular waves: one component."""
    waves = {
        "significant_height": height,
        "peak_period": period,
        "direction": direction,
        "components": 1,
    }
    return {"seed": 1, "waves": waves}


@pytest.mark.parametrize("vehicle", VESSELS)
@pytest.mark.parametrize("direction", [0.0, 1.2])
def test_long_waves_carry_the_hull(
    vehicle: dict[str, Any], direction: float, measured: MeasurementCheck
) -> None:
    """It follows elevation and slopes of waves of 150 m and more."""
    trial = WorldHarness(
        {"usv": {**vehicle, "position": [0.0, 0.0]}}, environment=swell(0.5, 10.0, direction)
    )
    calm = WorldHarness({"usv": {**vehicle, "position": [0.0, 0.0]}})
    rise, water, heel = [], [], []
    for _ in range(300):
        trial.step(10)
        rise.append(trial["usv.position.z"] - calm["usv.position.z"])
        water.append(trial["usv.wave.elevation"])
        heel.append(
            [trial["usv.attitude.roll"], trial["usv.attitude.pitch"] - calm["usv.attitude.pitch"]]
        )
    late = slice(100, None)  # after a start from rest in calm water
    assert np.ptp(water[late]) > 0.1
    error, case = np.abs(np.array(rise) - water)[late].max() / np.ptp(water), vehicle["model"]
    measured(
        "Waves",
        "heave beside waves of 150 m, share of their height",
        error,
        0.0,
        "1",
        "rides on them",
        within=0.05,
        case=case,
    )
    (wave,) = zip(*sea(swell(0.5, 10.0, direction)), strict=True)
    slope = wave[0] * wave[2]
    steepest = np.abs(heel[late]).max(axis=0)
    encounter = direction - trial["usv.attitude.yaw"]
    assert steepest == pytest.approx(
        slope * np.abs([np.sin(encounter), np.cos(encounter)]), abs=0.05 * slope
    )


def test_short_waves_pass_under_the_hull() -> None:
    """Waves of half the length of the hull move it by less than a fifth of their height."""
    trial = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0], motion="6dof")}, environment=swell(0.1, 0.5)
    )
    heights = [trial.step()["usv.position.z"] for _ in range(500)]
    assert np.ptp(heights[100:]) < 0.02


def test_gain_scales_the_waves() -> None:
    level = vessel_settings([0.0, 0.0], motion="6dof", parameters={"initial.on_waves": 0.0})
    trials = [WorldHarness({"usv": level}, environment=swell(0.02, 3.0)) for _ in range(2)]
    trials[1]["environment.wave_gain"] = 0.5
    heights = np.empty((300, 2))
    for row in heights:
        row[:] = trials[0].step()["usv.position.z"], trials[1].step()["usv.position.z"]
    full, half = (heights - p.CENTRE_OF_MASS_HEIGHT).T
    assert half == pytest.approx(full / 2, abs=0.01 * np.abs(full).max())


def test_motion_of_the_water_agrees_with_linear_theory(measured: MeasurementCheck) -> None:
    """Against sums over components and strips in NumPy, with the hull heeled and trimmed."""
    random, count = np.random.default_rng(1), 5
    frequency = random.uniform(1.0, 7.0, count)
    components = Sea(
        random.uniform(0, 0.1, count),
        frequency,
        frequency**2 / 9.81,
        *random.uniform(-3, 3, (2, count)),
    )
    used = (components.amplitude, components.frequency, components.direction, components.phase)
    columns = [ca.SX([*column, *np.zeros(64 - count)]) for column in used]
    attitude = Rotation.from_euler("ZYX", [0.7, 0.1, -0.2]).as_matrix()
    offset, spacing = (np.abs(POINTS).max(axis=0) / [2, 1])[::-1]
    layout = strips.Strips(ca.SX.zeros(3), ca.SX(spacing), ca.SX(offset))
    hull = strips.TwinHull(layout, ca.SX(BEAM), ca.SX(BOX_DRAUGHT), ca.SX(BEAM), ca.SX(AREA))
    table = wave_loads.wave_table(hull, *columns)
    water = wave_loads.water_motion(
        ca.SX([3.0, -2.0]), ca.SX(attitude), ca.SX(11.0), layout, ca.SX(1), ca.SX(count), table
    )
    points = [3.0, -2.0] + POINTS @ attitude[:2, :2].T
    expected = water_at(components, points, 11.0, POINTS, BEAM, BOX_DRAUGHT)
    pairs = {
        "elevation": (water.elevations, expected.elevations),
        "velocity": (water.velocity, expected.velocity),
        "rates": (water.rates, expected.rates[:2]),
        "acceleration": (water.acceleration, expected.acceleration),
        "angular acceleration": (water.angular_acceleration, expected.turning[:2]),
    }
    for case, (found, value) in pairs.items():
        values = ca.evalf(found).full().ravel()
        measured(
            "Waves",
            "motion of the water at a hull",
            values,
            value,
            "SI",
            "linear theory",
            within=1e-12,
            case=case,
        )


def test_sine_and_cosine_are_those_of_numpy() -> None:
    angles = np.random.default_rng(2).uniform(-1e5, 1e5, 5000)
    sine, cosine = computed(elementary_functions.sine_and_cosine, angles)
    assert np.abs(sine - np.sin(angles)).max() < 1e-13
    assert np.abs(cosine - np.cos(angles)).max() < 1e-13


def test_the_sine_of_a_share_of_a_right_angle_is_that_of_numpy() -> None:
    shares = np.random.default_rng(2).uniform(-1, 1, 5000)
    (found,) = computed(
        lambda share: (elementary_functions.sine_of_right_angle_share(share),), shares
    )
    assert np.abs(found - np.sin(np.pi / 2 * shares)).max() < 1e-15


@pytest.mark.parametrize("x", [0.0, 1e-12, 0.2, 1.0, 5.0])
def test_the_arctangent_is_that_of_numpy(x: float) -> None:
    y = np.concatenate([[0.0, x, -x, 1e-300], np.random.default_rng(2).uniform(-2, 2, 5000)])
    (found,) = computed(lambda y: (elementary_functions.arctangent(y, ca.SX(x)),), y)
    assert np.abs(found - np.arctan2(y, x)).max() < 1e-15


def test_the_logarithm_is_that_of_numpy() -> None:
    numbers = np.concatenate([[1.0], 10 ** np.random.default_rng(2).uniform(0, 9, 5000)])
    (found,) = computed(lambda x: (elementary_functions.logarithm(x),), numbers)
    assert np.abs(found - np.log(numbers)).max() < 4e-15


def test_the_exponential_is_that_of_numpy() -> None:
    numbers = np.random.default_rng(2).uniform(-3, 3, 5000)
    (found,) = computed(lambda x: (elementary_functions.exponential(x),), numbers)
    assert found == pytest.approx(np.exp(numbers), rel=1e-13)


def computed(expression: Any, values: np.ndarray) -> list[np.ndarray]:
    x = ca.SX.sym("x")
    function = ca.Function("f", [x], list(expression(x)))
    results = function(ca.DM(values).T)
    return [
        np.array(result).ravel()
        for result in (results if isinstance(results, tuple) else (results,))
    ]
