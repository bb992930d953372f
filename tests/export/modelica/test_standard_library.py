"""Blocks of the Modelica Standard Library against closed forms and scipy.signal; needs the library
in MODELICAPATH.
"""

from __future__ import annotations

import os

import numpy as np
import pytest
from scipy import signal

pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(
        not os.environ.get("MODELICAPATH"),
        reason="needs the Modelica Standard Library in MODELICAPATH",
    ),
]

STEP, COUNT = 0.01, 200

#: declaration of the block b, numerator and denominator of its transfer function
LINEAR = {
    "integrator": ("Continuous.Integrator b(k=2)", [2], [1, 0]),
    "derivative": ("Continuous.Derivative b(k=1, T=0.05)", [1, 0], [0.05, 1]),
    "first order": ("Continuous.FirstOrder b(k=2, T=0.3)", [2], [0.3, 1]),
    "second order": ("Continuous.SecondOrder b(k=1.5, w=4, D=0.3)", [1.5], [1 / 16, 0.15, 1]),
    "PI": ("Continuous.PI b(k=2, T=0.5)", [1, 2], [0.5, 0]),
    "transfer function": ("Continuous.TransferFunction b(b={1,2}, a={1,3,5})", [1, 2], [1, 3, 5]),
    "Butterworth": (
        "Continuous.LowpassButterworth b(n=3, f=2)",
        *signal.butter(3, 4 * np.pi, analog=True),
    ),
}


def block_model(declaration: str) -> str:
    return f"""model Kind
  Modelica.Blocks.Interfaces.RealInput u;
  Modelica.Blocks.Interfaces.RealOutput y;
  Modelica.Blocks.{declaration};
equation
  connect(u, b.u);
  connect(b.y, y);
end Kind;"""


def random_input() -> np.ndarray:
    return np.repeat(np.random.default_rng(1).uniform(-1.5, 1.5, COUNT // 10), 10)


def outputs(model, values: np.ndarray) -> np.ndarray:
    """Return the output after each step, with the input constant during the step."""
    model.initialize()
    result = []
    for k, value in enumerate(values):
        model.set(u=value)
        model.step(k * STEP, STEP)
        result.append(model.get("y"))
    return np.array(result, float)


@pytest.mark.parametrize("kind", LINEAR)
def test_a_linear_block_agrees_with_its_transfer_function(compile_both, kind):
    declaration, numerator, denominator = LINEAR[kind]
    values = random_input()
    a, b, c, d = signal.tf2ss(numerator, denominator)
    discrete_a, discrete_b, *_ = signal.cont2discrete((a, b, c, d), STEP)
    state, expected = np.zeros(len(a)), []
    for value in values:
        state = discrete_a @ state + discrete_b[:, 0] * value
        expected.append((c @ state + d[:, 0] * value)[0])
    assert outputs(compile_both(block_model(declaration)), values) == pytest.approx(
        np.array(expected), abs=1e-6
    )


@pytest.mark.parametrize(
    ("declaration", "function"),
    [
        ("Nonlinear.Limiter b(uMax=0.7)", lambda u: np.clip(u, -0.7, 0.7)),
        ("Nonlinear.DeadZone b(uMax=0.3)", lambda u: np.sign(u) * np.maximum(np.abs(u) - 0.3, 0)),
        ("Math.Sin b", np.sin),
    ],
)
def test_a_static_block_agrees_with_its_function(compile_both, declaration, function):
    values = random_input()
    assert outputs(compile_both(block_model(declaration)), values) == pytest.approx(
        function(values), abs=1e-12
    )


def test_a_discrete_transfer_function_is_exact(compile_both):
    values = random_input()
    declaration = "Discrete.TransferFunction b(b={1, 0.5}, a={1, -0.6, 0.2}, samplePeriod=0.05)"
    expected = np.repeat(signal.lfilter([0, 1, 0.5], [1, -0.6, 0.2], values[::5]), 5)
    assert outputs(compile_both(block_model(declaration)), values) == pytest.approx(
        expected, abs=1e-14
    )
