"""Extended Kalman filter of the inertial navigation: consistency by Monte Carlo, with the C code of
the FMU.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

import cosim
from cosim.core import resources
from plant_src.sensors.imu import IMU_DEVICES

HEADERS = resources.root() / "controllers/modelica/Estimation/Resources/Include"
COMPILER = shutil.which("cc") or shutil.which("gcc") or "cc"
SOURCE = """#include "inertial_ekf.h"
void start(int n, const double *p, const double *v, const double *b, const double *e,
           const double *d, const double *noise,
           double *s)
{ for (int i = 0; i < n; i++)
    ekf_start(p + 3 * i, v + 3 * i, b + 3 * i, e, d, noise, s + 244 * i); }
void step(int n, double *s, double h, const double *r, const double *f, const double *d, int fix,
          const double *p, const double *v, double delay, int has_field, const double *b,
          const double *e, const double *noise)
{ for (int i = 0; i < n; i++, s += 244)
    ekf_step(s, h, r + 3 * i, f + 3 * i, d, fix, p + 3 * i, v + 3 * i, delay, has_field,
             b + 3 * i, e, noise, s); }
"""
H, DELAY, SIZE = 0.01, 0.05, 244
NOISE = np.array([0.02, 0.03, 0.05, 0.012])
#: of the Earth (T) and its noise; the noise of the heading that it shows is FIELD_NOISE / 25.5e-6
FIELD, FIELD_NOISE = np.array([0.5e-6, 25.5e-6, -37e-6]), 0.306e-6
EARTH = np.array([np.arctan2(FIELD[1], FIELD[0]), np.arctan2(-FIELD[2], np.hypot(*FIELD[:2]))])
BIASES = np.array([0.02, 0.2])
INSTANTS = (1, 10, 30, 60, 100, 150, 200, 300)
#: number of starts
COUNT = 100
#: standard deviation of roll and pitch at the start (rad), noise density of the velocity, and
#: amplitudes of the rates (rad/s) and accelerations (m/s2)
VEHICLES = {"quadcopter": (0.02, 3e-3, 0.4, 1.5), "vessel": (0.04, 6e-3, 0.15, 0.5)}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("ekf")
    (folder / "ekf.c").write_text(SOURCE)
    subprocess.run(
        [COMPILER, "-O2", "-shared", "-fPIC", f"-I{HEADERS}", "ekf.c", "-o", "ekf.so", "-lm"],
        cwd=folder,
        check=True,
    )
    library, number = ctypes.CDLL(str(folder / "ekf.so")), ctypes.c_double
    array = np.ctypeslib.ndpointer(float, flags="C")
    library.start.argtypes = [ctypes.c_int, *[array] * 7]
    library.step.argtypes = [
        ctypes.c_int,
        array,
        number,
        *[array] * 3,
        ctypes.c_int,
        *[array] * 2,
        number,
        ctypes.c_int,
        *[array] * 3,
    ]
    return library


class Flights:
    """Manoeuvres with the shipped IMU and other sensors as in the model of the filter, and the
    filters; arrays (start, axis).
    """

    def __init__(self, library: Any, tilt: float, density: float, turning: float, pushing: float):
        rng = self.rng = np.random.default_rng(2)
        self.library, self.count, self.states = library, 0, np.zeros((COUNT, SIZE))
        self.density = np.array([density, 3e-4, 2e-5, 2e-4])
        self.position, self.velocity = np.zeros((COUNT, 3)), self._noise(1)
        tilts = np.column_stack([*rng.normal(0, tilt, (2, COUNT)), rng.uniform(-3, 3, COUNT)])
        self.attitude = Rotation.from_rotvec(tilts)
        self.biases = self._noise(BIASES[0]), self._noise(BIASES[1])
        self.motion = (
            turning,
            pushing,
            *rng.uniform(0.5, 2, (2, COUNT, 3)),
            rng.uniform(0, 6, (COUNT, 3)),
        )
        self.past: list[Any] = []
        deviations = np.array([tilt, *BIASES])
        library.start(
            COUNT,
            *self._fix(self.position, self.velocity),
            self._field(),
            EARTH,
            deviations,
            NOISE,
            self.states,
        )

    def _noise(self, deviation: Any) -> np.ndarray:
        return self.rng.normal(0, deviation, (COUNT, 3))

    def _field(self) -> np.ndarray:
        return np.asarray(self.attitude.inv().apply(FIELD) + self._noise(FIELD_NOISE))

    def _fix(self, position: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return position + self._noise(NOISE[[0, 0, 1]]), velocity + self._noise(NOISE[2])

    def step(self) -> None:
        t = self.count * H
        turning, pushing, turn, push, phase = self.motion
        rates, acceleration = turning * np.cos(turn * t + phase), pushing * np.cos(push * t + phase)
        middle = self.attitude * Rotation.from_rotvec(rates * H / 2)
        force = middle.inv().apply(acceleration + np.array([0, 0, 9.81]))
        self.position = self.position + H * (self.velocity + H / 2 * acceleration)
        self.velocity = self.velocity + H * acceleration
        self.attitude = self.attitude * Rotation.from_rotvec(rates * H)
        self.past.append((self.position, self.velocity))
        self._filter(self._measure("gyroscope", rates, 0), self._measure("accelerometer", force, 1))
        self.count += 1

    def _measure(self, device: str, true: np.ndarray, number: int) -> np.ndarray:
        data = IMU_DEVICES["bmi088"][device]
        self.biases[number][:] += self._noise(data["bias_walk"] * H**0.5)
        return np.asarray(true + self.biases[number] + self._noise(data["noise_density"] / H**0.5))

    def _filter(self, rates: np.ndarray, force: np.ndarray) -> None:
        k = self.count
        sight = (
            int(k % 10 == 9 and k > 10),
            *self._fix(*self.past[max(0, k - 5)]),
            DELAY,
            int(k % 2 == 0),
            self._field(),
            EARTH,
        )
        self.library.step(COUNT, self.states, H, rates, force, self.density, *sight, NOISE)

    def normalised_errors(self) -> np.ndarray:
        """Return the normalised estimation errors squared (NEES) of all 15 errors."""
        s = self.states
        turns = (Rotation.from_quat(s[:, [7, 8, 9, 6]]).inv() * self.attitude).as_rotvec()
        biases = self.biases[0] - s[:, 10:13], self.biases[1] - s[:, 13:16]
        errors = np.hstack([self.position - s[:, :3], self.velocity - s[:, 3:6], turns, *biases])[
            :, :, None
        ]
        return np.asarray(
            (errors * np.linalg.solve(s[:, 19:].reshape(-1, 15, 15), errors)).sum((1, 2))
        )


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_filter_is_consistent_from_the_start(library: Any, vehicle: str) -> None:
    """The mean NEES lies within the 95 % bounds of chi-squared at three quarters of the instants,
    and within 99.9 % at all.
    """
    flights, means = Flights(library, *VEHICLES[vehicle]), []
    for k in range(1, 301):
        flights.step()
        if k in INSTANTS:
            means.append(flights.normalised_errors().mean())
    found = np.array(means)
    lowest, low, high, highest = chi2.ppf([0.0005, 0.025, 0.975, 0.9995], 15 * COUNT) / COUNT
    assert ((found > lowest) & (found < highest)).all(), found
    assert ((found > low) & (found < high)).sum() >= 6, found


def shipped_flight(seed: int, stop_time: float) -> cosim.Result:
    """Fly on sensors in waves of 0.6 m, which the vessel meets from the first moment on."""
    sea = "/components/plant/arguments/environment"
    waves = {f"{sea}/waves/significant_height": 0.6, f"{sea}/waves/peak_period": 4.38}
    seeds = {f"{sea}/seed": seed, "/components/measured/parameters/seed": seed}
    everything = {"/record": {"signals": ["*"]}, "/kpis": [], "/checks": [], "/figures": []}
    return cosim.run(
        "landing_waves_on_sensors", {**waves, **seeds, **everything}, stop_time=stop_time
    )


def normalised_errors(result: cosim.Result, estimate: str, truth: str) -> np.ndarray:
    """Return the squared errors of position, velocity and attitude over their variances, shape
    (instants, 9).
    """
    position, motion = (
        (truth, truth) if truth == "plant.uav" else (f"{truth}.deck", f"{truth}.deck")
    )
    errors = [
        result[f"{estimate}.position.{axis}"] - result[f"{position}.position.{axis}"]
        for axis in "xyz"
    ]
    errors += [
        result[f"{estimate}.velocity.{axis}"] - result[f"{motion}.velocity.{axis}"]
        for axis in "xyz"
    ]
    turns = []
    for name in (estimate, truth):
        parts = [result[f"{name}.orientation.{part}"] for part in "xyzw"]
        turns.append(Rotation.from_quat(np.column_stack(parts)))
    errors += list((turns[0].inv() * turns[1]).as_rotvec().T)
    deviations = [result[f"{estimate}.deviation[{i}]"] for i in range(1, 10)]
    return np.column_stack(
        [
            (error[1:] / deviation[1:]) ** 2
            for error, deviation in zip(errors, deviations, strict=True)
        ]
    )


@pytest.mark.parametrize(
    ("estimate", "truth"), [("measured.navigation", "plant.uav"), ("measured.vessel", "plant.usv")]
)
def test_deviations_agree_with_the_errors_on_shipped_sensors(estimate: str, truth: str) -> None:
    """Over the first seconds in a seaway, take-off included, the mean squared error is that which
    the filter expects.
    """
    flights = [normalised_errors(shipped_flight(seed, 4.0), estimate, truth) for seed in (1, 2, 3)]
    after = np.mean([flight[20:] for flight in flights], axis=(0, 1))
    assert 0.4 < after.mean() < 1.8, after
    assert after.max() < 4, after


def test_quadcopter_lands_on_the_filter() -> None:
    result = cosim.run("landing_waves_on_sensors", {"/record": {"signals": ["*"]}})
    assert all(outcome.passed for outcome in result.checks)
    flying = (result.time > 3) & (result.time < 11)
    errors = [
        abs(result[f"measured.estimate.position.{axis}"] - result[f"plant.uav.position.{axis}"])[
            flying
        ].max()
        for axis in "xyz"
    ]
    assert max(errors) < 0.06
