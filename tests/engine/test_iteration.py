"""Fixed-point iteration of macro steps with rollback."""

import json

import numpy as np
import pytest
from fakes import FakeComponent, gain, inputs, integrator, outputs
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from systems import connection, make_system, run_system

from cosim.components.python_fmu import PythonFmuComponent
from cosim.core import resources
from cosim.core.component import StepResult
from cosim.core.errors import ComponentError, InputError
from cosim.core.system import Endpoint, Group, Iteration
from cosim.core.time_grid import exact_fraction
from cosim.engine import EXECUTORS
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.scenario import load

TIGHT = Iteration(1e-13, 100)
NEWTON = Iteration(1e-12, 20, "newton")
FMUS = resources.root() / "fmus"


def oscillator():
    """x' = v, v' = -x - d v in three components: two explicit Euler integrators and the force."""
    force = FakeComponent(
        [*inputs("x", "v"), *outputs("y")],
        lambda values, _t, _h: values.update(y=-values["x"] - 0.1 * values["v"]),
    )
    return {"x": integrator(1.0), "v": integrator(0.0), "f": force}


CONNECTIONS = "v.y > x.u, f.y > v.u, x.y > f.x, v.y > f.v"


def implicit_euler(steps, h):
    matrix = np.array([[0.0, 1.0], [-1.0, -0.1]])
    state, rows = np.array([1.0, 0.0]), []
    for _ in range(steps):
        state = np.linalg.solve(np.eye(2) - h * matrix, state)
        rows.append(state)
    return np.array(rows)


@pytest.mark.usefixtures("executor")
@pytest.mark.parametrize(
    "stages", [(("x", "v", "f"),), (("f",), ("v",), ("x",))], ids=["Jacobi", "Gauss-Seidel"]
)
def test_the_iteration_solves_the_implicit_equations_in_any_order_of_stages(stages):
    recording = run_system(
        make_system(oscillator(), CONNECTIONS, [(Group("all", stages, "auto", TIGHT),)]),
        2,
        "1/10",
        ["x.y", "v.y"],
    )
    found = np.column_stack([recording.columns["x.y"], recording.columns["v.y"]])[1:]
    np.testing.assert_allclose(found, implicit_euler(20, 0.1), rtol=0, atol=1e-11)


@pytest.mark.usefixtures("executor")
@pytest.mark.parametrize(
    "stages", [(("x", "v", "f"),), (("f",), ("v",), ("x",))], ids=["Jacobi", "Gauss-Seidel"]
)
def test_newtons_method_solves_a_coupling_for_which_the_fixed_point_diverges(stages):
    """The step of 3 s is beyond the natural period, so that each repetition is farther from the
    solution.
    """
    names, h = ["x.y", "v.y"], 3.0
    with pytest.raises(ComponentError, match="no convergence"):
        run_system(
            make_system(oscillator(), CONNECTIONS, [(Group("all", stages, "auto", TIGHT),)]),
            6,
            "3",
            names,
        )
    recording = run_system(
        make_system(oscillator(), CONNECTIONS, [(Group("all", stages, "auto", NEWTON),)]),
        15,
        "3",
        names,
    )
    found = np.column_stack([recording.columns[name] for name in names])[1:]
    np.testing.assert_allclose(found, implicit_euler(5, h), rtol=0, atol=1e-10)


@pytest.mark.usefixtures("executor")
def test_newtons_method_passes_integers_on():
    """a = 3 a + n - 1 with the integer n = 4, which another component counts: a = -1.5."""
    count = FakeComponent(
        [*inputs("u"), *outputs("n", type="Int32")], lambda values, _t, _h: values.update(n=4)
    )
    one = FakeComponent(
        [*inputs("u"), *inputs("n", type="Int32"), *outputs("y")],
        lambda values, _t, _h: values.update(y=3 * values["u"] + values["n"] - 1),
    )
    group = Group("all", (("a", "c"),), "auto", NEWTON)
    recording = run_system(
        make_system({"a": one, "c": count}, "a.y > a.u, c.n > a.n, a.y > c.u", [(group,)]),
        2,
        1,
        ["a.y"],
    )
    np.testing.assert_allclose(recording.columns["a.y"][1:], -1.5, atol=1e-10)


@pytest.mark.usefixtures("executor")
def test_components_outside_the_loop_step_once_per_macro_step():
    count = FakeComponent(outputs("y"), lambda values, _t, _h: values.update(y=values["y"] + 1))
    inner = Group("inner", (("a", "b"),), "auto", TIGHT)
    parts = {
        "count": count,
        "a": FakeComponent([*inputs("u", "w"), *outputs("y")], _half),
        "b": gain(0.5),
    }
    recording = run_system(
        make_system(parts, "count.y > a.u, b.y > a.w, a.y > b.u", [("count",), (inner,)]),
        3,
        1,
        ["count.y", "a.y"],
    )
    assert recording.columns["count.y"].tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(
        recording.columns["a.y"], np.arange(4) / 0.75, atol=1e-12
    )  # y = u + y / 4


def _half(values, _t, _h):
    values["y"] = values["u"] + 0.5 * values["w"]


@pytest.mark.usefixtures("executor")
def test_a_delayed_value_is_delivered_once_per_macro_step_in_an_iteration():
    count = FakeComponent(outputs("y"), lambda values, _t, _h: values.update(y=values["y"] + 1))
    parts = {
        "count": count,
        "a": FakeComponent([*inputs("u", "w"), *outputs("y")], _half),
        "b": gain(0.5),
    }
    group = Group("all", (("count", "a", "b"),), "auto", TIGHT)
    recording = run_system(
        make_system(parts, "count.y >2 a.u, b.y > a.w, a.y > b.u", [(group,)]), 6, 1, ["a.y"]
    )
    np.testing.assert_allclose(
        recording.columns["a.y"][1:], np.array([0, 0, 0, 1, 2, 3]) / 0.75, atol=1e-12
    )


@pytest.mark.usefixtures("executor")
def test_termination_requests_of_rejected_iterations_are_discarded():
    """With s = 0.8 u and u = 8 - 0.5 s from s = 0, the first iteration gives u = 8, the solution is
    8 / 1.4 = 5.7.
    """

    def step(values, t, h):
        values["y"] = 8 - 0.5 * values["u"] + t
        return StepResult(t + h, terminate_requested=values["y"] > 6.5)

    parts = {"s": gain(0.8), "h": FakeComponent([*inputs("u"), *outputs("y")], step)}
    built = make_system(
        parts, "s.y > h.u, h.y > s.u", [(Group("all", (("h",), ("s",)), "auto", TIGHT),)]
    )
    recording = run_system(built, 5, 1, ["h.y"])
    np.testing.assert_allclose(
        recording.columns["h.y"][1:], (8 + np.arange(3)) / 1.4, atol=1e-11
    )  # 5.7, 6.4, 7.1 > 6.5: termination


class Derivative(Fmi2Slave):
    """y = -u - 0.05 u'; the previous u is an attribute that is not a registered variable."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.u, self.y, self._last = 1.0, 0.0, 1.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, _t, h):
        self.y, self._last = -self.u - 0.05 * (self.u - self._last) / h, self.u
        return True


@pytest.mark.usefixtures("executor")
def test_the_whole_state_of_a_python_component_is_restored():
    """x' = y by implicit Euler: x (1 + h + 0.05) = previous x (1 + 0.05)."""
    parts = {"x": integrator(1.0), "d": PythonFmuComponent(Derivative(instance_name="d"), "d")}
    built = make_system(
        parts, "x.y > d.u, d.y > x.u", [(Group("all", (("d",), ("x",)), "auto", TIGHT),)]
    )
    recording = run_system(built, 1, "1/10", ["x.y"])
    np.testing.assert_allclose(recording.columns["x.y"], (1.05 / 1.15) ** np.arange(11), atol=1e-11)


@pytest.mark.usefixtures("executor")
def test_a_loop_inside_a_loop_converges():
    inner = Group("inner", (("v", "f"),), "auto", TIGHT)
    outer = Group("outer", ((inner,), ("x",)), "auto", TIGHT)
    recording = run_system(make_system(oscillator(), CONNECTIONS, [(outer,)]), 1, "1/10", ["x.y"])
    np.testing.assert_allclose(
        recording.columns["x.y"][1:], implicit_euler(10, 0.1)[:, 0], rtol=0, atol=1e-11
    )


@pytest.mark.usefixtures("executor")
def test_a_divergent_loop_is_reported_with_its_outputs_and_the_time():
    grows = FakeComponent(
        [*inputs("u"), *outputs("y")], lambda values, _t, _h: values.update(y=2 * values["u"] + 1)
    )
    group = Group("loop", (("a",), ("b",)), "auto", Iteration(1e-6, 7))
    with pytest.raises(ComponentError) as failure:
        run_system(
            make_system({"a": grows, "b": gain()}, "b.y > a.u, a.y > b.u", [(group,)]),
            1,
            "1/10",
            ["b.y"],
        )
    expected = (
        "no convergence after 7 iterations; outputs that still change by more than 1e-06: b.y, a.y"
    )
    assert str(failure.value) == f"loop: iteration failed at t = 0 s: {expected}"


def test_components_without_state_and_with_periods_are_refused_in_a_loop():
    stuck = gain()
    stuck.has_state = False
    group = Group("loop", (("a", "b"),), "auto", TIGHT)
    faulty = make_system(
        {"a": stuck, "b": gain()}, "a.y > b.u", [(group,)], periods={"b": exact_fraction("1/5")}
    )
    assert [problem.message for problem in faulty.problems()] == [
        (
            'the stages of loop are iterated, but "a" cannot return to a state (FMI: '
            "canGetAndSetFMUState)"
        ),
        'the stages of loop are iterated, so "b" cannot have a period of its own',
    ]


def vessel_and_helmsman(folder, iteration):
    document = {
        "name": "voyage",
        "stop_time": 5,
        "step_size": 0.05,
        "components": {
            "usv": {
                "fmu": str(FMUS / "strider.fmu"),
                "parameters": {"initial.velocity_body.u": 0.5, "thrust": 0.1},
            },
            "helm": {
                "fmu": str(FMUS / "fmi3" / "heading_controller.fmu"),
                "parameters": {"heading_reference": 0.3},
            },
        },
        "connections": [
            connection("usv", "helm.vehicle"),
            connection("helm.rudder_angle", "usv.rudder_angle"),
        ],
        "algorithm": {"stages": [["helm"], ["usv"]], **iteration},
    }
    path = folder / "voyage.json"
    path.write_text(json.dumps(document))
    return path


@pytest.fixture
def simulate_voyage(tmp_path):
    def simulate_with(kind, **iteration):
        prepared = load(vessel_and_helmsman(tmp_path, iteration))
        endpoints = [Endpoint("usv", f"position.{axis}") for axis in "xy"] + [
            Endpoint("helm", "rudder_angle")
        ]
        columns = {str(end): end for end in endpoints}
        outcome = simulate(
            prepared.system,
            Settings(
                exact_fraction(0), exact_fraction(5), exact_fraction("0.05"), columns, executor=kind
            ),
        )
        assert outcome.failure is None, outcome.failure
        return np.column_stack(list(outcome.recording.columns.values()))

    return simulate_with


def test_fmus_converge_within_the_tolerance_and_executors_are_bit_identical(simulate_voyage):
    loose, tight = (
        {"iteration": {"tolerance": tolerance, "limit": 100}} for tolerance in (1e-6, 1e-12)
    )
    found = simulate_voyage("auto", **tight)
    assert all(np.array_equal(found, simulate_voyage(kind, **tight)) for kind in EXECUTORS)
    assert 0 < np.abs(found - simulate_voyage("auto", **loose)).max() < 1e-3
    assert (
        np.abs(found - simulate_voyage("auto")).max() > 1e-3
    )  # without iteration, inputs are older


def test_invalid_iteration_settings_are_refused(tmp_path):
    with pytest.raises(InputError) as refusal:
        load(
            vessel_and_helmsman(tmp_path, {"iteration": {"tolerance": 0, "limit": 1, "rounds": 3}})
        )
    assert [problem.where.rpartition("$")[2] for problem in refusal.value.problems] == [
        ".algorithm.iteration.tolerance",
        ".algorithm.iteration.limit",
        ".algorithm.iteration.rounds",
    ]
