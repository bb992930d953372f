"""Macro steps repeated from the same state until the components agree."""

import json

import numpy as np
import pytest
from fakes import FakeComponent, gain, inputs, integrator, outputs
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from systems import connection, make_system, run_system

from cosim.api import load
from cosim.components.python_class import PythonFmuComponent
from cosim.core import resources
from cosim.core.component import StepResult
from cosim.core.errors import ComponentError, InputError
from cosim.core.system import Endpoint, Group, Iteration
from cosim.core.time_grid import exact_fraction
from cosim.engine import EXECUTORS
from cosim.engine.run_loop import simulate
from cosim.engine.settings import Settings

TIGHT = Iteration(1e-13, 100)
FMUS = resources.root() / "fmus"


def oscillator():
    """x' = v, v' = -x - d v in three components: two explicit Euler integrators and the force."""
    force = FakeComponent(
        [*inputs("x", "v"), *outputs("y")], lambda values, t, h: values.update(y=-values["x"] - 0.1 * values["v"])
    )
    return {"x": integrator(1.0), "v": integrator(0.0), "f": force}


WIRES = "v.y > x.u, f.y > v.u, x.y > f.x, v.y > f.v"


def implicit_euler(steps, h):
    matrix = np.array([[0.0, 1.0], [-1.0, -0.1]])
    state, rows = np.array([1.0, 0.0]), []
    for _ in range(steps):
        state = np.linalg.solve(np.eye(2) - h * matrix, state)
        rows.append(state)
    return np.array(rows)


@pytest.mark.usefixtures("executor")
@pytest.mark.parametrize("stages", [(("x", "v", "f"),), (("f",), ("v",), ("x",))], ids=["Jacobi", "Gauss-Seidel"])
def test_the_last_round_solves_the_implicit_equations_whatever_the_order(stages):
    recording = run_system(make_system(oscillator(), WIRES, [(Group("all", stages, "auto", TIGHT),)]), 2, "1/10", ["x.y", "v.y"])
    found = np.column_stack([recording.columns["x.y"], recording.columns["v.y"]])[1:]
    np.testing.assert_allclose(found, implicit_euler(20, 0.1), rtol=0, atol=1e-11)


@pytest.mark.usefixtures("executor")
def test_components_outside_are_not_repeated_and_are_read_once():
    count = FakeComponent(outputs("y"), lambda values, t, h: values.update(y=values["y"] + 1))
    inner = Group("inner", (("a", "b"),), "auto", TIGHT)
    parts = {"count": count, "a": FakeComponent([*inputs("u", "w"), *outputs("y")], _half), "b": gain(0.5)}
    recording = run_system(
        make_system(parts, "count.y > a.u, b.y > a.w, a.y > b.u", [("count",), (inner,)]), 3, 1, ["count.y", "a.y"]
    )
    assert recording.columns["count.y"].tolist() == [0, 1, 2, 3]
    np.testing.assert_allclose(recording.columns["a.y"], np.arange(4) / 0.75, atol=1e-12)  # y = u + y / 4


def _half(values, t, h):
    values["y"] = values["u"] + 0.5 * values["w"]


@pytest.mark.usefixtures("executor")
def test_a_delayed_value_arrives_once_in_a_step_however_many_rounds_it_takes():
    count = FakeComponent(outputs("y"), lambda values, t, h: values.update(y=values["y"] + 1))
    parts = {"count": count, "a": FakeComponent([*inputs("u", "w"), *outputs("y")], _half), "b": gain(0.5)}
    group = Group("all", (("count", "a", "b"),), "auto", TIGHT)
    recording = run_system(make_system(parts, "count.y >2 a.u, b.y > a.w, a.y > b.u", [(group,)]), 6, 1, ["a.y"])
    np.testing.assert_allclose(recording.columns["a.y"][1:], np.array([0, 0, 0, 1, 2, 3]) / 0.75, atol=1e-12)


@pytest.mark.usefixtures("executor")
def test_only_the_last_round_may_ask_to_end_the_simulation():
    """s = 0.8 u and u = 8 - 0.5 s from s = 0: the first guess is u = 8, the solution 8 / 1.4 = 5.7."""

    def step(values, t, h):
        values["y"] = 8 - 0.5 * values["u"] + t
        return StepResult(t + h, terminate_requested=values["y"] > 6.5)

    parts = {"s": gain(0.8), "h": FakeComponent([*inputs("u"), *outputs("y")], step)}
    built = make_system(parts, "s.y > h.u, h.y > s.u", [(Group("all", (("h",), ("s",)), "auto", TIGHT),)])
    recording = run_system(built, 5, 1, ["h.y"])
    np.testing.assert_allclose(recording.columns["h.y"][1:], (8 + np.arange(3)) / 1.4, atol=1e-11)  # 5.7, 6.4, 7.1: the end


class Derivative(Fmi2Slave):
    """y = -u - 0.05 u', which remembers the last u where nobody registered it."""

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.u, self.y, self._last = 1.0, 0.0, 1.0
        self.register_variable(Real("u", causality=Fmi2Causality.input))
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, t, h):
        self.y, self._last = -self.u - 0.05 * (self.u - self._last) / h, self.u
        return True


@pytest.mark.usefixtures("executor")
def test_python_components_return_to_all_that_they_hold():
    """x' = y by implicit Euler: x (1 + h + 0.05) = last x (1 + 0.05)."""
    parts = {"x": integrator(1.0), "d": PythonFmuComponent(Derivative(instance_name="d"), "d")}
    built = make_system(parts, "x.y > d.u, d.y > x.u", [(Group("all", (("d",), ("x",)), "auto", TIGHT),)])
    recording = run_system(built, 1, "1/10", ["x.y"])
    np.testing.assert_allclose(recording.columns["x.y"], (1.05 / 1.15) ** np.arange(11), atol=1e-11)


@pytest.mark.usefixtures("executor")
def test_loops_stand_inside_loops():
    inner = Group("inner", (("v", "f"),), "auto", TIGHT)
    outer = Group("outer", ((inner,), ("x",)), "auto", TIGHT)
    recording = run_system(make_system(oscillator(), WIRES, [(outer,)]), 1, "1/10", ["x.y"])
    np.testing.assert_allclose(recording.columns["x.y"][1:], implicit_euler(10, 0.1)[:, 0], rtol=0, atol=1e-11)


@pytest.mark.usefixtures("executor")
def test_what_never_agrees_is_named_with_the_place_and_the_time():
    grows = FakeComponent([*inputs("u"), *outputs("y")], lambda values, t, h: values.update(y=2 * values["u"] + 1))
    group = Group("loop", (("a",), ("b",)), "auto", Iteration(1e-6, 7))
    with pytest.raises(ComponentError) as failure:
        run_system(make_system({"a": grows, "b": gain()}, "b.y > a.u, a.y > b.u", [(group,)]), 1, "1/10", ["b.y"])
    expected = "no convergence after 7 iterations; outputs that still change by more than 1e-06: b.y, a.y"
    assert str(failure.value) == f"loop: iteration failed at t = 0 s: {expected}"


def test_what_cannot_return_to_a_state_is_refused_and_so_are_periods():
    stuck = gain()
    stuck.has_state = False
    group = Group("loop", (("a", "b"),), "auto", TIGHT)
    faulty = make_system({"a": stuck, "b": gain()}, "a.y > b.u", [(group,)], periods={"b": exact_fraction("1/5")})
    assert [problem.message for problem in faulty.problems()] == [
        'the stages of loop are iterated, but "a" cannot return to a state (FMI: canGetAndSetFMUState)',
        'the stages of loop are iterated, so "b" cannot have a period of its own',
    ]


def vessel_and_helmsman(folder, iteration):
    document = {
        "name": "voyage",
        "stop_time": 5,
        "step_size": 0.05,
        "components": {
            "usv": {"fmu": str(FMUS / "strider.fmu"), "parameters": {"initial.velocity_body.u": 0.5, "thrust": 0.1}},
            "helm": {"fmu": str(FMUS / "fmi3" / "heading_controller.fmu"), "parameters": {"heading_reference": 0.3}},
        },
        "connections": [connection("usv", "helm.vehicle"), connection("helm.rudder_angle", "usv.rudder_angle")],
        "algorithm": {"stages": [["helm"], ["usv"]], **iteration},
    }
    path = folder / "voyage.json"
    path.write_text(json.dumps(document))
    return path


@pytest.fixture
def voyages(tmp_path):
    def sail(kind, **iteration):
        assembly = load(vessel_and_helmsman(tmp_path, iteration))
        ends = [Endpoint("usv", f"position.{axis}") for axis in "xy"] + [Endpoint("helm", "rudder_angle")]
        columns = {str(found): found for found in ends}
        outcome = simulate(
            assembly.system, Settings(exact_fraction(0), exact_fraction(5), exact_fraction("0.05"), columns, executor=kind)
        )
        assert outcome.failure is None, outcome.failure
        return np.column_stack(list(outcome.recording.columns.values()))

    return sail


def test_fmus_agree_within_the_tolerance_and_executors_to_the_last_bit(voyages):
    loose, tight = ({"iteration": {"tolerance": tolerance, "limit": 100}} for tolerance in (1e-6, 1e-12))
    found = voyages("auto", **tight)
    assert all(np.array_equal(found, voyages(kind, **tight)) for kind in EXECUTORS)
    assert 0 < np.abs(found - voyages("auto", **loose)).max() < 1e-3
    assert np.abs(found - voyages("auto")).max() > 1e-3  # the plain run reads older values


def test_a_scenario_with_nonsense_for_an_iteration_is_refused(tmp_path):
    with pytest.raises(InputError) as refusal:
        load(vessel_and_helmsman(tmp_path, {"iteration": {"tolerance": 0, "limit": 1, "rounds": 3}}))
    assert [problem.where.rpartition("$")[2] for problem in refusal.value.problems] == [
        ".algorithm.iteration.tolerance",
        ".algorithm.iteration.limit",
        ".algorithm.iteration.rounds",
    ]
