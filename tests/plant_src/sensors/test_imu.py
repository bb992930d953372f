"""The inertial measurement unit against mechanics, and its noise against the theory of the Allan
variance.
"""

from itertools import product

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_harness import STEP, SensorHarness, quaternion, with_parameters

from cosim.core.errors import InputError
from plant_src.sensors.imu import Imu

AXES = [*(f"acceleration.{axis}" for axis in "xyz"), *(f"rates.{axis}" for axis in "pqr")]
KINDS = ("gyroscope", "accelerometer")
ALLAN = "theory of the Allan variance"
_ERRORS = product(KINDS, ("noise_density", "bias_walk", "turn_on_bias"))
EXACT = {f"{kind}__{what}": 0.0 for kind, what in _ERRORS}


def exact_imu(**parameters):
    return with_parameters(Imu("imu"), **EXACT, **parameters)


def test_specific_force_is_one_g_upwards_at_rest_in_every_attitude(measured):
    attitude = quaternion((1, 2, 3), 0.7)
    trial = SensorHarness(exact_imu(), vehicle__orientation=attitude).step(3)
    upwards = Rotation.from_quat([*attitude[1:], attitude[0]]).inv().apply([0, 0, 9.81])
    measured(
        "Sensors",
        "IMU at rest, tilted",
        trial.vector("acceleration"),
        upwards,
        "m/s2",
        "gravity",
        within=1e-12,
    )


def test_specific_force_is_zero_in_free_fall(measured):
    trial = SensorHarness(exact_imu(), vehicle__velocity=(1.0, 2.0, 3.0))
    for step in range(1, 5):
        trial.set_inputs(vehicle__velocity=(1.0, 2.0, 3.0 - 9.81 * step * STEP)).step()
        measured(
            "Sensors",
            "IMU in free fall",
            trial.vector("acceleration"),
            0.0,
            "m/s2",
            "weightlessness",
            within=1e-12,
        )


def test_specific_force_on_a_circle_is_centripetal():
    speed, rate = 4.0, 0.8
    angles = rate * STEP * np.arange(4)
    trial = SensorHarness(exact_imu(), vehicle__velocity=(speed, 0, 0), vehicle__rates=(0, 0, rate))
    for angle in angles[1:]:
        velocity = (speed * np.cos(angle), speed * np.sin(angle), 0)
        trial.set_inputs(
            vehicle__velocity=velocity, vehicle__orientation=quaternion((0, 0, 1), angle)
        ).step()
    mean = (
        speed * rate * np.sin(rate * STEP / 2) / (rate * STEP / 2)
    )  # over the step, along the direction halfway
    assert np.allclose(trial.vector("acceleration"), (0, mean, 9.81), atol=1e-10)
    assert np.array_equal(trial.vector("rates", "pqr"), (0, 0, rate))


def test_the_sign_of_the_quaternion_does_not_matter():
    attitude = quaternion((1, 0, 0), 0.3)
    trial = SensorHarness(exact_imu(), vehicle__orientation=attitude).step()
    before = trial.vector("acceleration")
    assert np.allclose(
        trial.set_inputs(vehicle__orientation=-attitude).step().vector("acceleration"),
        before,
        atol=1e-12,
    )


def test_scale_misalignment_bias_and_range():
    matrix = np.array([[1.1, 0.02, 0], [0, 0.9, -0.01], [0.03, 0, 1.0]])
    imu = exact_imu(gyroscope__matrix=matrix, gyroscope__bias=[0.1, 0.2, 0.3], gyroscope__range=2.0)
    trial = SensorHarness(imu, vehicle__rates=(1.0, -2.0, 3.0)).step()
    wanted = np.clip(matrix @ (1.0, -2.0, 3.0) + (0.1, 0.2, 0.3), -2, 2)
    assert np.allclose(trial.vector("rates", "pqr"), wanted, atol=1e-14)


def allan_deviation(values, count):
    """Return the Allan deviation of rates sampled at STEP, from means over `count` samples next to
    each other.
    """
    means = values[: len(values) // count * count].reshape(-1, count).mean(axis=1)
    return np.sqrt(np.mean(np.diff(means) ** 2) / 2)


def test_white_noise_has_the_allan_deviation_of_its_density(measured):
    density = 3e-3
    imu = with_parameters(
        Imu("imu", seed=11),
        **{**EXACT, "gyroscope__noise_density": density, "accelerometer__noise_density": density},
    )
    noise = SensorHarness(imu).record(20000, AXES) - (0, 0, 9.81, 0, 0, 0)
    for values in noise.T:
        for count in (1, 10, 50):
            found, expected, case = (
                allan_deviation(values, count),
                density / np.sqrt(count * STEP),
                f"{count * STEP:g} s",
            )
            measured(
                "Sensors",
                "IMU noise, Allan deviation",
                found,
                expected,
                "m/s2, rad/s",
                ALLAN,
                relative=0.12,
                case=case,
            )


def test_bias_walk_has_the_allan_deviation_of_a_random_walk(measured):
    walk = 2e-2
    imu = with_parameters(
        Imu("imu", seed=3),
        **{**EXACT, "gyroscope__bias_walk": walk, "accelerometer__bias_walk": walk},
    )
    bias = SensorHarness(imu).record(20000, AXES)
    found = [allan_deviation(values, 50) for values in bias.T]
    found, expected = np.sqrt(np.mean(np.square(found))), walk * np.sqrt(50 * STEP / 3)
    measured(
        "Sensors",
        "IMU bias walk, Allan deviation",
        found,
        expected,
        "m/s2, rad/s",
        ALLAN,
        relative=0.12,
    )


def test_turn_on_bias_has_its_standard_deviation_over_many_devices():
    parameters = {**EXACT, "gyroscope__turn_on_bias": 0.5}
    biases = [
        SensorHarness(with_parameters(Imu("imu", seed=seed), **parameters)).vector("rates", "pqr")
        for seed in range(150)
    ]
    assert np.std(biases) == pytest.approx(0.5, rel=0.12)
    assert abs(np.mean(biases)) < 0.5 * 4 / np.sqrt(450)


def test_an_unknown_device_is_refused_with_the_nearest_name():
    with pytest.raises(InputError, match='"bmi088"'):
        Imu("imu", device="bmi08")
