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
void start(const double *p, double yaw, const double *d, double *n) { ekf_start(p, yaw, d, n); }
void step(const double *s, double h, const double *r, const double *f, const double *d, int fix, const double *p, const double *v,
          double delay, int has_yaw, double yaw, const double *noise, double *n)
{ ekf_step(s, h, r, f, d, fix, p, v, delay, has_yaw, yaw, noise, n); }
"""
H, DELAY, SIZE = 0.01, 0.05, 244
DENSITY, NOISE = np.array([2e-3, 3e-4, 2e-5, 2e-4]), np.array([0.012, 0.02, 0.05, 0.03])
START = np.array([0.05, 0.1, 0.03, 0.01, 0.05])


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("ekf")
    (folder / "ekf.c").write_text(SOURCE)
    subprocess.run([COMPILER, "-O2", "-shared", "-fPIC", f"-I{HEADERS}", "ekf.c", "-o", "ekf.so", "-lm"], cwd=folder, check=True)
    library, number = ctypes.CDLL(str(folder / "ekf.so")), ctypes.c_double
    array = np.ctypeslib.ndpointer(float, flags="C")
    library.start.argtypes = [array, number, array, array]
    library.step.argtypes = [array, number, *[array] * 3, ctypes.c_int, *[array] * 2, number, ctypes.c_int, number, array, array]
    return library


class Flight:
    """A manoeuvre with noisy sensors that agree with the model of the filter, and the filter."""

    def __init__(self, library: Any, seed: int):
        rng = self.rng = np.random.default_rng(seed)
        self.library, self.count, self.state = library, 0, np.zeros(SIZE)
        self.position, self.velocity = rng.normal(0, START[0], 3), rng.normal(0, START[1], 3)
        self.attitude = Rotation.from_rotvec(rng.normal(0, START[2], 3))
        self.biases = rng.normal(0, START[3], 3), rng.normal(0, START[4], 3)
        self.motion = rng.uniform(0.5, 2, 3), rng.uniform(0.5, 2, 3), rng.uniform(0, 6, 3)
        self.past: list[Any] = []
        library.start(np.zeros(3), 0.0, START, self.state)

    def step(self) -> None:
        rng, t = self.rng, self.count * H
        turn, push, phase = self.motion
        rates, acceleration = 0.4 * np.cos(turn * t + phase), 1.5 * np.cos(push * t + phase)
        middle = self.attitude * Rotation.from_rotvec(rates * H / 2)
        force = middle.inv().apply(acceleration + np.array([0, 0, 9.81]))
        self.position = self.position + H * (self.velocity + H / 2 * acceleration)
        self.velocity = self.velocity + H * acceleration
        self.attitude = self.attitude * Rotation.from_rotvec(rates * H)
        gyro, accelerometer = self.biases
        self.biases = gyro + rng.normal(0, DENSITY[2] * H**0.5, 3), accelerometer + rng.normal(0, DENSITY[3] * H**0.5, 3)
        self.past.append((self.position, self.velocity))
        self._filter(rates + self.biases[0], force + self.biases[1])
        self.count += 1

    def _filter(self, rates: np.ndarray, force: np.ndarray) -> None:
        rng, k = self.rng, self.count
        measured = rates + rng.normal(0, DENSITY[1] / H**0.5, 3), force + rng.normal(0, DENSITY[0] / H**0.5, 3)
        place, speed = self.past[max(0, k - 5)]
        fix = place + rng.normal(0, NOISE[[0, 0, 1]]), speed + rng.normal(0, NOISE[2], 3)
        yaw = self.attitude.as_euler("ZYX")[0] + rng.normal(0, NOISE[3])
        following = np.empty(SIZE)
        has_fix, has_yaw = int(k % 10 == 9 and k > 10), int(k % 2 == 0)
        self.library.step(self.state, H, *measured, DENSITY, has_fix, *fix, DELAY, has_yaw, yaw, NOISE, following)
        self.state = following

    def normalised_error(self) -> float:
        """Return the normalised estimation error squared (NEES) of all 15 errors."""
        s = self.state
        turn = (self.attitude * Rotation.from_quat(s[[7, 8, 9, 6]]).inv()).as_rotvec()
        biases = self.biases[0] - s[10:13], self.biases[1] - s[13:16]
        error = np.concatenate([self.position - s[:3], self.velocity - s[3:6], turn, *biases])
        return float(error @ np.linalg.solve(s[19:].reshape(15, 15), error))


def test_filter_is_consistent(library: Any) -> None:
    """The mean NEES of 8 flights lies within the 95 % bounds of chi-squared at most instants, and within 99.9 % at all."""
    flights, means = [Flight(library, seed) for seed in range(8)], []
    for k in range(1, 601):
        for flight in flights:
            flight.step()
        if k % 100 == 0:
            means.append(np.mean([flight.normalised_error() for flight in flights]))
    found = np.array(means)
    lowest, low, high, highest = chi2.ppf([0.0005, 0.025, 0.975, 0.9995], 15 * 8) / 8
    assert ((found > lowest) & (found < highest)).all(), found
    assert ((found > low) & (found < high)).sum() >= 4, found


def test_quadcopter_lands_on_the_filter() -> None:
    system = str(resources.root() / "scenarios/systems/navigation_suite_kalman.json")
    result = cosim.run("landing_waves_on_sensors", {"/components/measured/system": system, "/record": {"signals": ["*"]}})
    assert all(outcome.passed for outcome in result.checks)
    flying = (result.time > 3) & (result.time < 11)
    errors = [
        abs(result[f"measured.estimate.position.{axis}"] - result[f"plant.uav.position.{axis}"])[flying].max() for axis in "xyz"
    ]
    assert max(errors) < 0.06
