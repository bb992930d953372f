"""Model predictive control of the landing and the forecast of the deck: against SciPy and NumPy."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.signal import cont2discrete

from cosim.core import resources

HEADERS = resources.root() / "controllers/modelica/Fleet/Resources/Include"
COMPILER = shutil.which("cc") or shutil.which("gcc") or "cc"
STEPS, STEP, LAG, WEIGHTS = 20, 0.1, 0.12, (40.0, 8.0, 0.1)


@pytest.fixture(scope="module")
def command(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., float]:
    """First command of the shipped C code for errors, lower and upper bounds."""
    folder = tmp_path_factory.mktemp("mpc")
    signature = (
        "const double *e, double h, double l, double p, double v, double r, const double *a, const "
        "double *b"
    )
    call = "box_mpc_command(e, h, l, p, v, r, a, b)"
    (folder / "mpc.c").write_text(
        f'#include "box_mpc.h"\ndouble command({signature}) {{ return {call}; }}\n'
    )
    subprocess.run(
        [COMPILER, "-O2", "-shared", "-fPIC", f"-I{HEADERS}", "mpc.c", "-o", "mpc.so", "-lm"],
        cwd=folder,
        check=True,
    )
    function = ctypes.CDLL(str(folder / "mpc.so")).command
    array = np.ctypeslib.ndpointer(float, flags="C")
    function.argtypes, function.restype = (
        [array, *[ctypes.c_double] * 5, array, array],
        ctypes.c_double,
    )

    def call_it(error: Any, lower: Any, upper: Any) -> float:
        return float(
            function(
                *(
                    np.asarray(error, float),
                    STEP,
                    LAG,
                    *WEIGHTS,
                    np.asarray(lower, float),
                    np.asarray(upper, float),
                )
            )
        )

    return call_it


def optimal_command(error: Any, lower: Any, upper: Any) -> float:
    """Return the same from the matrix exponential and SciPy's bounded least squares."""
    model = np.array([[0.0, 1, 0], [0, 0, -1], [0, 0, -1 / LAG]]), np.array([[0.0], [0], [1 / LAG]])
    a, b, *_ = cont2discrete((*model, np.eye(3), np.zeros((3, 1))), STEP)
    roots = np.sqrt(WEIGHTS)
    rows, target = [], []
    for k in range(1, STEPS + 1):
        effect = np.hstack(
            [
                np.linalg.matrix_power(a, k - 1 - j) @ b if j < k else np.zeros((3, 1))
                for j in range(STEPS)
            ]
        )
        rows.append(roots[:2, None] * effect[:2])
        target.append(-roots[:2] * (np.linalg.matrix_power(a, k) @ error)[:2])
    system = np.vstack([*rows, roots[2] * np.eye(STEPS)])
    bounds = np.repeat(lower, 2), np.repeat(upper, 2)
    return float(
        lsq_linear(system, np.concatenate([*target, np.zeros(STEPS)]), bounds, tol=1e-14).x[0]
    )


def test_command_is_that_of_an_independent_solver(command: Callable[..., float]) -> None:
    rng, at_a_bound = np.random.default_rng(1), 0
    for _ in range(40):
        error = rng.normal(0, [0.5, 0.8, 1.0])
        lower, upper = -rng.uniform(0.5, 5, 10), rng.uniform(0.5, 5, 10)
        found = command(error, lower, upper)
        assert found == pytest.approx(optimal_command(error, lower, upper), abs=2e-5)
        at_a_bound += found in (lower[0], upper[0])
    assert 5 < at_a_bound < 35


def deck_velocity(seed: int) -> np.ndarray:
    """Return a deck velocity in an irregular swell of 3 to 5 s at 100 Hz over 120 s (m/s)."""
    rng, t = np.random.default_rng(seed), 0.01 * np.arange(12_000)
    omega, phase = rng.uniform(1.2, 2.1, 12), rng.uniform(0, 2 * np.pi, 12)
    return np.asarray(0.1 * np.cos(np.outer(t, omega) + phase).sum(axis=1))


def recursive_least_squares(samples: np.ndarray, forgetting: float = 0.998) -> np.ndarray:
    """Return the forecasts of 1 to 10 steps after the last sample, by the equations of the
    textbook.
    """
    covariance, weights = 100 * np.eye(8), np.zeros(8)
    padded = np.concatenate([np.zeros(8), samples])
    for k, sample in enumerate(samples):
        past = padded[k : k + 8][::-1]
        scale = past @ covariance @ past
        memory = forgetting if scale > 1e-4 else 1.0
        gain = covariance @ past / (memory + scale)
        weights = weights + gain * (sample - weights @ past)
        covariance = (covariance - np.outer(gain, past @ covariance)) / memory
    for _ in range(10):
        padded = np.append(padded, weights @ padded[-8:][::-1])
    return padded[-10:]


def test_forecast_of_two_seconds_has_a_known_error(controller: Callable[..., Any]) -> None:
    velocity = deck_velocity(1)
    fmu, rows = controller("deck_forecast"), []
    for u in velocity:
        out = fmu.step({"u": u})
        rows.append([out["age"], out["forecast[10]"], out["error_rms"], out["usual_rms"]])
    table = np.array(rows)
    late = np.arange(8000, 11_800)
    late = late[table[late, 0] == 0]
    error = velocity[late + 200] - table[late, 1]
    assert np.sqrt(np.mean(error**2)) < 0.35 * velocity.std()
    held = velocity[late + 200] - velocity[late]
    assert np.sqrt(np.mean(held**2)) > 1.2 * velocity.std()
    assert table[-1, 2] == pytest.approx(np.sqrt(np.mean(error**2)), rel=0.5)
    assert table[-1, 3] == pytest.approx(velocity.std(), rel=0.4)


def test_forecast_is_that_of_the_textbook(controller: Callable[..., Any]) -> None:
    velocity = deck_velocity(2)[:2401]
    fmu = controller("deck_forecast")
    out = [fmu.step({"u": u}) for u in velocity][-1]
    expected = recursive_least_squares(velocity[::20])
    np.testing.assert_allclose([out[f"forecast[{k}]"] for k in range(1, 11)], expected, atol=1e-8)
    rates = np.diff(expected, prepend=velocity[-1]) / 0.2
    np.testing.assert_allclose([out[f"acceleration[{k}]"] for k in range(1, 11)], rates, atol=1e-6)
