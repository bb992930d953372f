"""Settings of the environment: valid ones are read, invalid ones are refused."""

from __future__ import annotations

import math
from typing import Any

import pytest

from cosim.core.errors import InputError
from plant_src.environment import sea
from plant_src.environment.settings import EnvironmentSettings, read_environment
from plant_src.environment.wind_and_current import turbulence_intensities
from plant_src.json_reader import JsonReader

WIND = {"speed": 5.0, "direction": 1.0}


def read_valid(**environment: Any) -> EnvironmentSettings:
    reader = JsonReader()
    found = read_environment(reader, environment)
    assert reader.problems == []
    return found


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        (
            {"sea_stat": 3},
            r'environment.sea_stat: unknown key "sea_stat"; did you mean "sea_state"\?',
        ),
        ({"seed": -1}, "environment.seed: found -1, expected an integer of at least 0"),
        ({"sea_state": 10}, "environment.sea_state: found 10, expected an integer from 0 to 9"),
        ({"sea_state": -1}, "environment.sea_state: found -1, expected an integer from 0 to 9"),
        ({"sea_state": 2.5}, "environment.sea_state: found 2.5, expected an integer from 0 to 9"),
        (
            {"sea_state": 3, "waves": {"significant_height": 1}},
            'waves.significant_height: found beside "sea_state"',
        ),
        ({"waves": {}}, 'environment.waves: "significant_height" is missing'),
        ({"waves": 3}, r"environment.waves: found 3, expected an object \{...\}"),
        (
            {"waves": {"significant_height": -0.1}},
            "significant_height: found -0.1, expected a number from 0 to 30",
        ),
        (
            {"waves": {"significant_height": 1, "peak_period": 0}},
            "peak_period: found 0, expected a number greater than 0",
        ),
        (
            {"sea_state": 3, "waves": {"spectrum": "jonswop"}},
            r"""spectrum: found 'jonswop'; did you mean "jonswap"\?""",
        ),
        (
            {"sea_state": 3, "waves": {"gamma": 3}},
            'waves.gamma: a "pierson_moskowitz" spectrum has no peak enhancement',
        ),
        (
            {"sea_state": 3, "waves": {"spectrum": "jonswap", "gamma": 8}},
            "gamma: found 8, expected a number from 1 to 7",
        ),
        (
            {"sea_state": 3, "waves": {"spreading": -1}},
            "spreading: found -1, expected a number from 0 to 1000",
        ),
        (
            {"sea_state": 3, "waves": {"components": 65}},
            "components: found 65, expected an integer from 1 to 64",
        ),
        ({"wind": {}}, 'environment.wind: "speed" is missing'),
        ({"wind": {"speed": -1}}, "environment.wind.speed: found -1, expected at least 0"),
        (
            {"wind": {"speed": 1, "velocity": [1, 0, 0]}},
            'environment.wind.speed: found beside "velocity"',
        ),
        (
            {"wind": {"velocity": [1, 0]}},
            r"wind.velocity: found \[1, 0\], expected a list of 3 numbers \[x, y, z\]",
        ),
        (
            {"wind": {**WIND, "turbulance": {}}},
            r'unknown key "turbulance"; did you mean "turbulence"\?',
        ),
        ({"wind": {"speed": 0, "turbulence": {}}}, 'wind.turbulence: "airspeed" is missing'),
        (
            {"wind": {**WIND, "turbulence": {"height": 1}}},
            "turbulence.height: found 1, expected a number from 3.048 to 304.8",
        ),
        (
            {"wind": {**WIND, "turbulence": {"speed_20ft": -1}}},
            "turbulence.speed_20ft: found -1, expected at least 0",
        ),
        (
            {"wind": {**WIND, "turbulence": {"intensity": [1, 1, -1]}}},
            "expected standard deviations of at least 0",
        ),
        (
            {"wind": {**WIND, "turbulence": {"intensity": [1, 1, 1], "speed_20ft": 5}}},
            'found beside "intensity"',
        ),
        ({"wind": {**WIND, "profile": {}}}, 'profile: expected either "exponent" or "roughness"'),
        (
            {"wind": {**WIND, "profile": {"roughness": 20}}},
            "roughness: found 20, expected less than the reference height of 10",
        ),
        (
            {"current": {"speed": math.nan}},
            "environment.current.speed: found nan, expected a finite number",
        ),
        ({"current": {"velocity": [1, 0, 0]}}, "expected a list of 2 numbers"),
        (
            {"current": {"speed": 1, "ramp": {"change": [1, 0]}}},
            'environment.current.ramp: "duration" is missing',
        ),
        (
            {"current": {"speed": 1, "ramp": {"change": [1, 0], "duration": 0}}},
            "duration: found 0, expected a number greater",
        ),
        (
            {"current": {"speed": 1, "variation": {"standard_deviation": 1}}},
            '"time_constant" is missing',
        ),
    ],
)
def test_a_faulty_environment_is_refused(environment: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        sea(environment)
    assert len(caught.value.problems) == 1
    assert caught.value.problems[0].subject[:2] == ("arguments", "environment")


def test_all_problems_are_reported_together() -> None:
    with pytest.raises(InputError) as caught:
        sea(
            {"sea_state": 11, "waves": {"gama": 1}, "wind": {"speed": "x"}, "current": 3, "tide": 0}
        )
    assert [".".join(problem.subject[2:]) for problem in caught.value.problems] == [
        "tide",
        "sea_state",
        "waves.gama",
        "wind.speed",
        "current",
    ]


def test_an_empty_environment_is_calm() -> None:
    assert read_valid() == EnvironmentSettings(0, None, None, None)


def test_a_direction_is_that_of_the_flow() -> None:
    found = read_valid(
        wind={"speed": 5.0, "direction": math.pi / 2}, current={"speed": 0.5, "direction": math.pi}
    )
    assert found.wind
    assert found.current
    assert found.wind.velocity == pytest.approx((0.0, 5.0, 0.0))
    assert found.current.velocity == pytest.approx((-0.5, 0.0))


def test_the_turbulence_intensity_defaults_to_that_of_the_mean_wind() -> None:
    found = read_valid(wind={**WIND, "turbulence": {}}).wind
    assert found
    assert found.turbulence
    assert found.turbulence.airspeed == pytest.approx(5.0)
    assert found.turbulence.intensities == pytest.approx(turbulence_intensities(5.0, 6.096))


def test_turbulence_can_be_set_explicitly() -> None:
    turbulence = {"intensity": [0.5, 0.4, 0.3], "airspeed": 2.0, "height": 20.0}
    found = read_valid(wind={"speed": 0.0, "turbulence": turbulence}).wind
    assert found
    assert found.turbulence
    assert found.turbulence.intensities == (0.5, 0.4, 0.3)
    assert (found.turbulence.airspeed, found.turbulence.height) == (2.0, 20.0)


@pytest.mark.parametrize(
    ("profile", "height", "share"),
    [
        ({"exponent": 0.5}, 2.5, 0.5),
        ({"exponent": 0.5}, -1.0, 0.0),
        ({"exponent": 0.0}, 7.0, 1.0),
        ({"roughness": 0.1}, 1.0, 0.5),
        ({"roughness": 0.1}, 0.05, 0.0),
        ({"roughness": 0.001, "reference_height": 1.0}, 10.0, 4 / 3),
    ],
)
def test_wind_grows_with_height(profile: dict[str, float], height: float, share: float) -> None:
    found = read_valid(wind={**WIND, "profile": profile}).wind
    assert found
    assert found.profile
    assert found.profile(height) == pytest.approx(share)
