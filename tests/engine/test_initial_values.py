"""Algebraic loops in initialization: fixed point, then Newton's method."""

import math

import numpy as np
import pytest
from fakes import FakeComponent, gain, inputs, outputs
from systems import make_system, run_system

from cosim.core.errors import ComponentError
from cosim.core.units import parse_unit
from cosim.engine.initialization import find_loops

pytestmark = pytest.mark.usefixtures("executor")


class Function(FakeComponent):
    """y = function(u, v), directly; with a derivative (with respect to u) it offers directional
    derivatives.
    """

    def __init__(self, function, derivative=None, start=0.0, **attributes):
        def feed(values):
            values["y"] = function(values["u"], values["v"])

        variables = [*inputs("u", "v", **attributes), *outputs("y", **attributes)]
        super().__init__(variables, lambda values, _t, _h: feed(values), feed, {"y": start})
        self._derivative, self.asked = derivative, 0

    def get_directional_derivative(self, outputs, input_name):
        self.asked += 1
        return (
            [self._derivative(self.values["u"]) for _ in outputs]
            if self._derivative and input_name == "u"
            else None
        )


@pytest.mark.parametrize(
    "derivative", [None, lambda _u: 2.0], ids=["differences", "directional derivatives"]
)
def test_a_loop_with_a_gain_above_1_is_solved(derivative):
    one = Function(lambda u, _v: 2 * u + 1, derivative)
    recording = run_system(make_system({"a": one}, "a.y > a.u"), 3, 1, ["a.y"])
    assert recording.columns["a.y"][0] == pytest.approx(-1.0, abs=1e-11)
    assert one.asked > 0


def test_a_nonlinear_loop_through_two_components_with_units_is_solved():
    """x = y / 1000 (mm to m), y = 3000 exp(-x) - 1000: 1.01 x = 3 exp(-x) - 1 has a root by
    bisection.
    """
    mm, m = parse_unit("mm"), parse_unit("m")
    one = Function(lambda u, _v: 3 * math.exp(-u) - 1 - 3 * u, start=0.0, unit=m)
    two = Function(lambda u, v: u + v, lambda _u: 1.0, unit=mm)
    recording = run_system(make_system({"a": one, "b": two}, "a.y > b.u, b.y > a.u"), 1, 1, ["a.y"])
    root = recording.columns["a.y"][0]
    assert root == pytest.approx(3 * math.exp(-root) - 1 - 3 * root, abs=1e-11)
    assert 0.2 < root < 0.5


def test_a_loop_downstream_of_a_loop_gets_its_solution():
    """a = 3 a - 4 = 2; b = a - 5 b = 1 / 3; c = 10 b."""
    parts = {
        "c": gain(10.0),
        "b": Function(lambda u, v: v - 5 * u),
        "a": Function(lambda u, _v: 3 * u - 4, lambda _u: 3.0),
    }
    recording = run_system(
        make_system(parts, "a.y > a.u, a.y > b.v, b.y > b.u, b.y > c.u"),
        1,
        1,
        ["a.y", "b.y", "c.y"],
    )
    found = [recording.columns[name][0] for name in ("a.y", "b.y", "c.y")]
    np.testing.assert_allclose(found, [2.0, 1 / 3, 10 / 3], rtol=1e-11)


def test_a_linear_network_of_many_components_is_solved():
    """y = A y + b with random A, whose spectral radius is above 1."""
    rng = np.random.default_rng(3)
    n = 6
    matrix, constant = rng.normal(size=(n, n)), rng.normal(size=n)
    variables = [*inputs(*(f"u{j}" for j in range(n))), *outputs("y")]
    parts = {f"s{i}": FakeComponent(variables, *_row(matrix[i], constant[i])) for i in range(n)}
    wires = ", ".join(f"s{j}.y > s{i}.u{j}" for i in range(n) for j in range(n))
    names = [f"s{i}.y" for i in range(n)]
    recording = run_system(make_system(parts, wires), 1, 1, names)
    found = [recording.columns[name][0] for name in names]
    np.testing.assert_allclose(found, np.linalg.solve(np.eye(n) - matrix, constant), rtol=1e-9)


def _row(factors, constant):
    def feed(values):
        values["y"] = constant + sum(f * values[f"u{j}"] for j, f in enumerate(factors))

    return lambda values, _t, _h: feed(values), feed


def test_a_loop_without_a_solution_is_reported_with_its_residuals():
    built = make_system(
        {"a": Function(lambda u, _v: u + 1), "b": gain(), "c": gain()},
        "a.y > b.u, b.y > a.u, a.y > c.u",
    )
    with pytest.raises(ComponentError) as failure:
        run_system(built, 1, 1)
    text = str(failure.value)
    assert text.startswith(
        "b, a: initialization failed at t = 0 s: an algebraic loop does not converge (a.y -> b.u, "
        "b.y -> a.u"
    )
    assert "residuals after Newton's method: " in text


def test_declared_dependencies_decide_what_is_a_loop():
    """Without them, every output may depend on every input of its component."""
    plant, controller = gain(), gain()
    wires = "plant.y > controller.u, controller.y > plant.u"
    system = make_system({"plant": plant, "controller": controller}, wires)
    (loop,) = find_loops(system)
    assert sorted(map(str, loop)) == ["controller.u", "controller.y", "plant.u", "plant.y"]
    plant.initial_dependencies = {"y": frozenset()}
    assert find_loops(system) == []
