"""Function calls in equations, sums over table rows and derived parameters."""

from __future__ import annotations

import platform
from collections.abc import Callable
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from test_equations import Compiled

from cosim.core.component import Variable
from cosim.export.equations.c_code import Callee, call_in_c, function_body, sum_over_rows
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel

ROWS = 16


def parameter(name: str, *values: float) -> Variable:
    shape = (len(values),) if len(values) > 1 else ()
    return Variable(
        name,
        causality="parameter",
        variability="fixed",
        start=values if shape else values[0],
        shape=shape,
    )


def model(rate: Callable[..., ca.SX], *parameters: Variable, **options: Any) -> ContinuousModel:
    """Create the model x' = rate(x, inputs, parameters) with x(0) = 0 and the output x."""
    variables = (
        *parameters,
        Variable("u", causality="input", start=1.0),
        Variable("x", causality="output"),
    )
    return ContinuousModel(
        "called",
        "A model that calls functions",
        variables,
        ("x",),
        lambda _: ca.SX(0),
        rate,
        lambda x, _u, _p: x,
        **options,
    )


def waves(cosine: Callable[[ca.SX], ca.SX] = ca.cos) -> Callee:
    """Create the sum of amplitude * cos(frequency * (x + 2 t)) over rows (amplitude, frequency),
    and the sum of amplitudes.
    """
    common, row = ca.SX.sym("common", 2), ca.SX.sym("row", 2)
    term = ca.Function(
        "term",
        [common, row],
        [ca.vertcat(row[0] * cosine(row[1] * (common[0] + 2 * common[1])), row[0])],
    )
    return sum_over_rows("waves", term, ROWS)


def numbers(count: int) -> np.ndarray:
    return np.random.default_rng(count).uniform(0.1, 2.0, count)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 16])
def test_a_sum_over_rows_uses_only_the_first_rows(count: int, tmp_path: Path) -> None:
    callee, x, n, table = waves(), ca.SX.sym("x", 2), ca.SX.sym("n"), ca.SX.sym("table", ROWS, 2)
    probe = ca.Function("probe", [x, n, table], [3 * callee(x, n, table)])
    compiled = Compiled(as_block(model(lambda _x, u, _p: u, callees=[callee]), [probe]), tmp_path)
    amplitude, frequency = np.split(numbers(2 * ROWS), 2)
    amplitude[count:] = np.nan
    found = compiled.call("probe", 2, [0.3, 0.2], [float(count)], [*amplitude, *frequency])
    used, speed = amplitude[:count], frequency[:count]
    assert found == pytest.approx(
        [3 * (used * np.cos(0.7 * speed)).sum(), 3 * used.sum()], rel=1e-14
    )


@pytest.mark.skipif(platform.machine() != "x86_64", reason="its registers have these names")
@pytest.mark.parametrize("count", [5, ROWS])
def test_a_sum_is_bit_identical_for_every_simd_width(count: int, tmp_path: Path) -> None:
    """The function compiled for one SIMD width gives the same bits as the one that chooses its
    width at run time.
    """
    callee, x, table = (
        waves(lambda angle: 1 - angle**2 * (0.5 - 0.04 * angle**2)),
        ca.SX.sym("x", 2),
        ca.SX.sym("table", ROWS, 2),
    )
    probe = ca.Function("probe", [x, table], [callee(x, ca.SX(count), table)])
    block = as_block(model(lambda _x, u, _p: u, callees=[callee]), [probe])
    known = {"sse2", "avx2", "avx512f"} & {*Path("/proc/cpuinfo").read_text().split()}
    options = {name: [f'-DWIDE=__attribute__((target("{name}")))'] for name in known} | {
        "automatic": []
    }
    results = []
    for name, chosen in options.items():
        (folder := tmp_path / name).mkdir()
        compiled = Compiled(block, folder, *chosen)
        results.append(
            [compiled.call("probe", 2, [x, 0.2], [*numbers(2 * ROWS)]) for x in numbers(30)]
        )
    assert all(sums == results[0] for sums in results)


def test_casadi_computes_the_same_sum() -> None:
    table = numbers(2 * ROWS).reshape(2, ROWS).T
    found = np.array(waves().function([0.3, 0.2], 5, table)).ravel()
    assert found == pytest.approx(
        [(table[:5, 0] * np.cos(0.7 * table[:5, 1])).sum(), table[:5, 0].sum()], rel=1e-14
    )


def test_a_table_of_consecutive_arguments_is_not_copied() -> None:
    callee, parameters = waves(), ca.SX.sym("p", 2 * ROWS + 1)
    total = callee(parameters[0:2], ca.SX(3), ca.reshape(parameters[1:], ROWS, 2))
    text = function_body(ca.Function("probe", [parameters], [total]))
    assert "in[0] + 1}" in text
    assert f"in[0][{2 * ROWS}]" not in text


def test_a_called_function_is_a_function_in_c(tmp_path: Path) -> None:
    """It is also called by another called function, with several arguments and results in any
    order.
    """
    a, b = ca.SX.sym("a", 2), ca.SX.sym("b")
    inner = ca.Function("inner", [a, b], [a * b, a[0] - b])
    scaled, difference = call_in_c(inner, a[[1, 0]], 2 * b)
    outer = ca.Function("outer", [b, a], [ca.sum1(scaled) + difference])
    (total,) = call_in_c(outer, b, a)
    probe = ca.Function(
        "probe",
        [a, b],
        [ca.vertcat(total, call_in_c(inner, a, b)[1], call_in_c(inner, a, total)[0])],
    )
    block = as_block(model(lambda _x, u, _p: u), [probe])
    text = block.files["model.c"]
    assert text.count("static void inner(") == text.count("static void outer(") == 1
    assert text.index("static void inner(") < text.index("static void outer(")
    found = Compiled(block, tmp_path).call("probe", 4, [3.0, 5.0], [0.5])
    expected = 5.0 + 3.0 + (5.0 - 1.0)
    assert found == [expected, 2.5, 3.0 * expected, 5.0 * expected]


def test_a_callee_with_a_hand_written_body_and_its_required_functions(tmp_path: Path) -> None:
    """Only one branch of the body is executed: the square root of a negative number is not
    computed.
    """
    x = ca.SX.sym("x")
    root = ca.Function("root", [x], [ca.sqrt(x)])
    either = ca.Function("either", [x], [ca.if_else(x > 0, ca.sqrt(ca.fabs(x)), -1)])
    branch = Callee(
        either, "{\n    if (in[0][0] > 0) root(in, out);\n    else out[0][0] = -1;\n}\n", [root]
    )
    probe = ca.Function("probe", [x], [2 * branch(x)])
    compiled = Compiled(as_block(model(lambda _x, u, _p: u, callees=[branch]), [probe]), tmp_path)
    assert [compiled.call("probe", 1, [value]) for value in (9.0, -4.0)] == [[6.0], [-2.0]]


def test_a_state_derivative_can_contain_a_sum_over_rows(tmp_path: Path) -> None:
    """x' = sum of a cos(w (x + 2 t)) with constant t = u / 2 = 0.5: one Runge-Kutta step agrees
    with Python.
    """
    callee, (amplitude, frequency) = waves(), np.split(numbers(2 * ROWS), 2)

    def rate(x: ca.SX, u: ca.SX, p: ca.SX) -> ca.SX:
        return callee(ca.vertcat(x, u / 2), ca.SX(ROWS), ca.reshape(p, ROWS, 2))[0]

    table = parameter("table", *amplitude, *frequency)
    compiled = Compiled(as_block(model(rate, table, callees=[callee])), tmp_path)
    compiled.initialize()
    compiled.step(0.005)

    def slope(x: float) -> float:
        return float((amplitude * np.cos(frequency * (x + 1.0))).sum())

    h, k1 = 0.005, slope(0.0)
    k2 = slope(h / 2 * k1)
    k3 = slope(h / 2 * k2)
    expected = h / 6 * (k1 + 2 * k2 + 2 * k3 + slope(h * k3))
    assert compiled.model.output[0] == pytest.approx(expected, rel=1e-13)


@pytest.fixture
def exponential(tmp_path: Path) -> Compiled:
    """Create the model x' = u / (time constant); the time constant is derived from mass and
    damping.
    """
    model_ = model(
        lambda _x, u, c: u / c[1],
        parameter("mass", 6.0),
        parameter("damping", 2.0),
        derived_parameters=lambda p: ca.vertcat(p[0], p[0] / p[1], p[1]),
    )
    return Compiled(as_block(model_), tmp_path)


def test_derived_parameters_are_computed_at_the_initialization(exponential: Compiled) -> None:
    exponential.initialize()
    assert list(exponential.model.constant) == [6.0, 3.0, 2.0]
    exponential.model.parameter[1] = 12.0
    exponential.initialize()
    exponential.step(0.1)
    assert exponential.model.output[0] == pytest.approx(0.2, rel=1e-14)


def test_a_model_without_derived_parameters_has_no_member_for_them(tmp_path: Path) -> None:
    compiled = Compiled(
        as_block(model(lambda _x, u, p: u * p[0], parameter("gain", 2.0))), tmp_path
    )
    assert not hasattr(compiled.model, "constant")
    compiled.initialize()
    compiled.step(0.1)
    assert compiled.model.output[0] == pytest.approx(0.2, rel=1e-14)
