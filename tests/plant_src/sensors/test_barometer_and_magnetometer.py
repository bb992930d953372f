"""Barometer and magnetometer against the standard atmosphere and plain geometry."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_harness import SensorHarness, with_parameters

from plant_src.sensors.barometer import Barometer, altitude_at, pressure_at
from plant_src.sensors.magnetometer import EARTH_FIELD, Magnetometer


def attitude(roll, pitch, yaw):
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    x, y, z, w = turn.as_quat()
    return turn, (w, x, y, z)


def test_pressures_of_the_standard_atmosphere(measured):
    """Table of ISO 2533 (1975): 0, 500, 1000 and 5000 m of geopotential altitude."""
    for altitude, pressure in ((0, 101325.0), (500, 95460.8), (1000, 89874.6), (5000, 54019.9)):
        case = f"{altitude} m"
        measured(
            "Sensors",
            "barometer",
            pressure_at(altitude),
            pressure,
            "Pa",
            "table of ISO 2533",
            relative=2e-5,
            case=case,
        )
        assert altitude_at(pressure_at(altitude)) == pytest.approx(altitude, abs=1e-8)


def test_altitude_is_exact_without_errors():
    trial = SensorHarness(with_parameters(Barometer("b"), noise=0.0, drift=0.0)).set_inputs(
        vehicle__position__z=12.5
    )
    assert trial.step(2)["altitude"] == pytest.approx(12.5, abs=1e-8)


def test_pressure_at_zero_shifts_the_altitude():
    barometer = with_parameters(
        Barometer("b"), noise=0.0, drift=0.0, pressure_at_zero=101325.0 - 120.0
    )
    assert SensorHarness(barometer)["altitude"] == pytest.approx(
        10.0, abs=0.05
    )  # 12 Pa for a metre at sea level


def test_noise_and_drift_of_the_pressure():
    barometer = with_parameters(Barometer("b", seed=5), noise=3.0, drift=0.0, rate=100.0)
    assert SensorHarness(barometer).record(4000, ["pressure"]).std() == pytest.approx(3.0, rel=0.05)
    barometer = with_parameters(
        Barometer("b", seed=5), noise=0.0, drift=5.0, correlation_time=0.5, rate=100.0
    )
    assert SensorHarness(barometer).record(20000, ["pressure"]).std() == pytest.approx(
        5.0, rel=0.15
    )


@pytest.mark.parametrize("angles", [(0, 0, 0), (0.3, 0, 1.0), (0, -0.4, -2.5), (0.5, 0.4, 3.0)])
def test_field_is_rotated_to_body_axes_and_yields_the_heading(angles, measured):
    turn, orientation = attitude(*angles)
    trial = SensorHarness(
        with_parameters(Magnetometer("m"), noise=0.0), vehicle__orientation=orientation
    )
    assert np.allclose(trial.vector("field"), turn.inv().apply(EARTH_FIELD), atol=1e-18)
    measured(
        "Sensors",
        "magnetometer: heading",
        trial["yaw"],
        angles[2],
        "rad",
        "rotated field",
        within=1e-9,
    )


def test_hard_and_soft_iron_distort_the_field():
    soft, hard = np.diag([1.1, 0.9, 1.0]) + 0.02, np.array([4e-6, -3e-6, 2e-6])
    turn, orientation = attitude(0.1, 0.2, 0.3)
    magnetometer = with_parameters(Magnetometer("m"), noise=0.0, soft_iron=soft, hard_iron=hard)
    trial = SensorHarness(magnetometer, vehicle__orientation=orientation)
    assert np.allclose(
        trial.vector("field"), soft @ turn.inv().apply(EARTH_FIELD) + hard, atol=1e-18
    )


def test_hard_iron_rotates_the_heading():
    horizontal = np.hypot(*EARTH_FIELD[:2])
    trial = SensorHarness(
        with_parameters(
            Magnetometer("m"),
            noise=0.0,
            earth=[0, horizontal, 0],
            hard_iron=[0.1 * horizontal, 0, 0],
        )
    )
    assert trial["yaw"] == pytest.approx(np.arctan(0.1), abs=1e-9)


def test_noise_of_the_field():
    magnetometer = with_parameters(Magnetometer("m", seed=1), noise=1e-6, rate=100.0)
    spread = (
        SensorHarness(magnetometer).record(4000, [f"field.{axis}" for axis in "xyz"]).std(axis=0)
    )
    assert spread == pytest.approx([1e-6] * 3, rel=0.06)
