"""Extended Kalman filter of the inertial navigation: consistency by Monte Carlo, with the C code of the FMU."""

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

HEADERS = resources.root() / "controllers/modelica/Estimation/Resources/Include"
COMPILER = shutil.which("cc") or shutil.which("gcc") or "cc"
SOURCE = """#include "inertial_ekf.h"
void start(const double *p, const double *v, const double *b, const double *e, const double *d, const double *noise, double *n)
{ ekf_start(p, v, b, e, d, noise, n); }
void step(const double *s, double h, const double *r, const double *f, const double *d, int fix, const double *p, const double *v,
          double delay, int has_field, const double *b, const double *e, const double *noise, double *n)
{ ekf_step(s, h, r, f, d, fix, p, v, delay, has_field, b, e, noise, n); }
"""
H, DELAY, SIZE = 0.01, 0.05, 244
NOISE = np.array([0.02, 0.03, 0.05, 0.012])
#: of the Earth (T) and its noise; the noise of the heading that it shows is FIELD_NOISE / 25.5e-6
FIELD, FIELD_NOISE = np.array([0.5e-6, 25.5e-6, -37e-6]), 0.306e-6
EARTH = np.array([np.arctan2(FIELD[1], FIELD[0]), np.arctan2(-FIELD[2], np.hypot(*FIELD[:2]))])
BIASES = np.array([0.02, 0.2])
INSTANTS = (1, 10, 30, 60, 100, 150, 200, 300)
#: standard deviation of roll and pitch at the start (rad), noise density of the velocity, and amplitudes of the rates (rad/s) and
#: accelerations (m/s2)
VEHICLES = {"quadcopter": (0.02, 6e-3, 0.4, 1.5), "vessel": (0.04, 1e-2, 0.15, 0.5)}


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("ekf")
    (folder / "ekf.c").write_text(SOURCE)
    subprocess.run([COMPILER, "-O2", "-shared", "-fPIC", f"-I{HEADERS}", "ekf.c", "-o", "ekf.so", "-lm"], cwd=folder, check=True)
    library, number = ctypes.CDLL(str(folder / "ekf.so")), ctypes.c_double
    array = np.ctypeslib.ndpointer(float, flags="C")
    library.start.argtypes = [array] * 7
    library.step.argtypes = [array, number, *[array] * 3, ctypes.c_int, *[array] * 2, number, ctypes.c_int, *[array] * 4]
    return library


class Flight:
    """A manoeuvre with noisy sensors that agree with the model of the filter, and the filter."""

    def __init__(self, library: Any, seed: int, tilt: float, density: float, turning: float, pushing: float):
        rng = self.rng = np.random.default_rng(seed)
        self.library, self.count, self.state = library, 0, np.zeros(SIZE)
        self.density = np.array([density, 3e-4, 2e-5, 2e-4])
        self.position, self.velocity = np.zeros(3), rng.normal(0, 1, 3)
        self.attitude = Rotation.from_rotvec([*rng.normal(0, tilt, 2), rng.uniform(-3, 3)])
        self.biases = rng.normal(0, BIASES[0], 3), rng.normal(0, BIASES[1], 3)
        self.motion = turning, pushing, *rng.uniform(0.5, 2, (2, 3)), rng.uniform(0, 6, 3)
        self.past: list[Any] = []
        fix = rng.normal(0, NOISE[[0, 0, 1]]), self.velocity + rng.normal(0, NOISE[2], 3)
        library.start(*fix, self._field(), EARTH, np.array([tilt, *BIASES]), NOISE, self.state)

    def _field(self) -> np.ndarray:
        return np.asarray(self.attitude.inv().apply(FIELD) + self.rng.normal(0, FIELD_NOISE, 3))

    def step(self) -> None:
        rng, t = self.rng, self.count * H
        turning, pushing, turn, push, phase = self.motion
        rates, acceleration = turning * np.cos(turn * t + phase), pushing * np.cos(push * t + phase)
        middle = self.attitude * Rotation.from_rotvec(rates * H / 2)
        force = middle.inv().apply(acceleration + np.array([0, 0, 9.81]))
        self.position = self.position + H * (self.velocity + H / 2 * acceleration)
        self.velocity = self.velocity + H * acceleration
        self.attitude = self.attitude * Rotation.from_rotvec(rates * H)
        gyro, accelerometer = self.biases
        gyro_walk, force_walk = (rng.normal(0, density * H**0.5, 3) for density in self.density[2:])
        self.biases = gyro + gyro_walk, accelerometer + force_walk
        self.past.append((self.position, self.velocity))
        self._filter(rates + self.biases[0], force + self.biases[1])
        self.count += 1

    def _filter(self, rates: np.ndarray, force: np.ndarray) -> None:
        rng, k = self.rng, self.count
        measured = rates + rng.normal(0, self.density[1] / H**0.5, 3), force + rng.normal(0, self.density[0] / H**0.5, 3)
        place, speed = self.past[max(0, k - 5)]
        fix = place + rng.normal(0, NOISE[[0, 0, 1]]), speed + rng.normal(0, NOISE[2], 3)
        following = np.empty(SIZE)
        has_fix, has_field = int(k % 10 == 9 and k > 10), int(k % 2 == 0)
        sight = has_fix, *fix, DELAY, has_field, self._field(), EARTH
        self.library.step(self.state, H, *measured, self.density, *sight, NOISE, following)
        self.state = following

    def normalised_error(self) -> float:
        """Return the normalised estimation error squared (NEES) of all 15 errors."""
        s = self.state
        turn = (Rotation.from_quat(s[[7, 8, 9, 6]]).inv() * self.attitude).as_rotvec()
        biases = self.biases[0] - s[10:13], self.biases[1] - s[13:16]
        error = np.concatenate([self.position - s[:3], self.velocity - s[3:6], turn, *biases])
        return float(error @ np.linalg.solve(s[19:].reshape(15, 15), error))


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_filter_is_consistent_from_the_start(library: Any, vehicle: str) -> None:
    """The mean NEES of 8 starts lies within the 95 % bounds of chi-squared at half of the instants, and within 99.9 % at all."""
    flights, means = [Flight(library, seed, *VEHICLES[vehicle]) for seed in range(8)], []
    for k in range(1, 301):
        for flight in flights:
            flight.step()
        if k in INSTANTS:
            means.append(np.mean([flight.normalised_error() for flight in flights]))
    found = np.array(means)
    lowest, low, high, highest = chi2.ppf([0.0005, 0.025, 0.975, 0.9995], 15 * 8) / 8
    assert ((found > lowest) & (found < highest)).all(), found
    assert ((found > low) & (found < high)).sum() >= 4, found


def shipped_flight(seed: int, stop_time: float) -> cosim.Result:
    """Fly on sensors in waves of 0.6 m, which the vessel meets from the first moment on."""
    sea = "/components/plant/arguments/environment"
    waves = {f"{sea}/waves/significant_height": 0.6, f"{sea}/waves/peak_period": 4.38}
    seeds = {f"{sea}/seed": seed, "/components/measured/parameters/seed": seed}
    everything = {"/record": {"signals": ["*"]}, "/kpis": [], "/checks": [], "/figures": []}
    return cosim.run("landing_waves_on_sensors", {**waves, **seeds, **everything}, stop_time=stop_time)


def normalised_errors(result: cosim.Result, estimate: str, truth: str) -> np.ndarray:
    """Return the squared errors of position, velocity and attitude over their variances, shape (instants, 9)."""
    position, motion = (truth, truth) if truth == "plant.uav" else (f"{truth}.deck", f"{truth}.deck")
    errors = [result[f"{estimate}.position.{axis}"] - result[f"{position}.position.{axis}"] for axis in "xyz"]
    errors += [result[f"{estimate}.velocity.{axis}"] - result[f"{motion}.velocity.{axis}"] for axis in "xyz"]
    turns = [
        Rotation.from_quat(np.column_stack([result[f"{name}.orientation.{part}"] for part in "xyzw"]))
        for name in (estimate, truth)
    ]
    errors += list((turns[0].inv() * turns[1]).as_rotvec().T)
    deviations = [result[f"{estimate}.deviation[{i}]"] for i in range(1, 10)]
    return np.column_stack([(error[1:] / deviation[1:]) ** 2 for error, deviation in zip(errors, deviations, strict=True)])


@pytest.mark.parametrize(("estimate", "truth"), [("measured.navigation", "plant.uav"), ("measured.vessel", "plant.usv")])
def test_deviations_agree_with_the_errors_on_shipped_sensors(estimate: str, truth: str) -> None:
    """Over the first seconds in a seaway, take-off included, the mean squared error is that which the filter expects."""
    flights = [normalised_errors(shipped_flight(seed, 4.0), estimate, truth) for seed in (1, 2, 3)]
    after = np.mean([flight[20:] for flight in flights], axis=(0, 1))
    assert 0.4 < after.mean() < 1.8, after
    assert after.max() < 4, after


def test_quadcopter_lands_on_the_filter() -> None:
    result = cosim.run("landing_waves_on_sensors", {"/record": {"signals": ["*"]}})
    assert all(outcome.passed for outcome in result.checks)
    flying = (result.time > 3) & (result.time < 11)
    errors = [
        abs(result[f"measured.estimate.position.{axis}"] - result[f"plant.uav.position.{axis}"])[flying].max() for axis in "xyz"
    ]
    assert max(errors) < 0.06
