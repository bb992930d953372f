"""Data flow of a macro step: stages, groups, periods, delays, units, initialization, results of
steps.
"""

import itertools
import re

import numpy as np
import pytest
from fakes import FakeComponent, clock, counter, gain, inputs, integrator, outputs
from systems import endpoint, make_system, run_system

from cosim.core import component_log
from cosim.core.component import StepResult, Variable
from cosim.core.errors import ComponentError
from cosim.core.system import Group
from cosim.core.text import escape_control_characters
from cosim.core.time_grid import exact_fraction
from cosim.core.units import parse_unit
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

pytestmark = pytest.mark.usefixtures("executor")


def chain(n):
    """Return components with y = u + 1."""

    def step(values, _t, _h):
        values["y"] = values["u"] + 1

    return {f"c{i}": FakeComponent([*inputs("u"), *outputs("y")], step) for i in range(n)}


RING = "c0.y > c1.u, c1.y > c2.u, c2.y > c0.u"
NAMES = ("c0", "c1", "c2")


def final(stages, steps=3):
    recording = run_system(
        make_system(chain(3), RING, stages), steps, 1, [f"{name}.y" for name in NAMES]
    )
    return [recording.columns[f"{name}.y"][-1] for name in NAMES]


def test_components_of_one_stage_read_old_values():
    assert final([NAMES], steps=1) == [1, 1, 1]


def test_components_of_later_stages_read_new_values():
    assert final([("c0",), ("c1",), ("c2",)], steps=1) == [1, 2, 3]


def test_the_order_inside_a_stage_has_no_influence():
    results = [final([order], steps=5) for order in itertools.permutations(NAMES)]
    assert all(result == results[0] for result in results)


def test_stages_between_jacobi_and_gauss_seidel():
    assert final([("c0", "c1"), ("c2",)], steps=1) == [1, 1, 2]


def test_a_group_reads_outside_values_at_the_start_of_its_stage_and_steps_in_its_own_order():
    components = chain(4)
    wires = "c0.y > c1.u, c1.y > c2.u, c2.y > c3.u, c3.y > c0.u"
    stages = [("c0", Group("g", (("c1",), ("c2",)))), ("c3",)]
    recording = run_system(
        make_system(components, wires, stages), 1, 1, ["c0.y", "c1.y", "c2.y", "c3.y"]
    )
    # c1 reads the old c0 although c0 is named before it; c2 reads the new c1; c3 the new c2
    assert [column[-1] for column in recording.columns.values()] == [1, 1, 2, 3]


def test_components_do_not_read_new_values_of_a_group_in_their_stage():
    components = chain(3)
    stages = [(Group("g", (("c0",), ("c1",))), "c2")]
    recording = run_system(
        make_system(components, "c0.y > c1.u, c1.y > c2.u", stages), 1, 1, ["c1.y", "c2.y"]
    )
    assert [column[-1] for column in recording.columns.values()] == [2, 1]


def test_a_group_in_a_group():
    components = chain(3)
    inner = Group("g.h", (("c1",), ("c2",)))
    stages = [(Group("g", (("c0",), (inner,))),)]
    recording = run_system(
        make_system(components, "c0.y > c1.u, c1.y > c2.u", stages), 1, 1, ["c2.y"]
    )
    assert recording.columns["c2.y"][-1] == 3


def test_a_slow_component_steps_at_its_period_with_its_own_step_size():
    built = make_system(
        {"slow": clock(), "fast": counter()}, periods={"slow": exact_fraction(0.05)}
    )
    recording = run_system(built, 0.1, 0.01, ["slow.y", "fast.y"])
    assert recording.columns["slow.y"].tolist() == [0] + 5 * [0.05] + 5 * [0.1]
    assert recording.columns["fast.y"][-1] == 10


def test_a_delay_counts_macro_steps_and_starts_with_the_initial_output():
    direct = make_system({"a": counter(), "b": gain()}, "a.y > b.u", [("a",), ("b",)])
    late = make_system({"a": counter(), "b": gain()}, "a.y >3 b.u", [("a",), ("b",)])
    assert run_system(direct, 6, 1, ["b.y"]).columns["b.y"].tolist() == [0, 1, 2, 3, 4, 5, 6]
    assert run_system(late, 6, 1, ["b.y"]).columns["b.y"].tolist() == [0, 0, 0, 0, 1, 2, 3]


def test_a_delay_counts_macro_steps_for_slow_readers_too():
    built = make_system(
        {"a": counter(), "b": gain()},
        "a.y >1 b.u",
        [("a",), ("b",)],
        periods={"b": exact_fraction(2)},
    )
    assert run_system(built, 6, 1, ["b.y"]).columns["b.y"].tolist() == [0, 0, 0, 2, 2, 4, 4]


def test_a_delay_inside_a_group_counts_each_macro_step_once():
    built = make_system(
        {"a": counter(), "b": gain()}, "a.y >2 b.u", [(Group("g", (("a",), ("b",))),)]
    )
    assert run_system(built, 5, 1, ["b.y"]).columns["b.y"].tolist() == [0, 0, 0, 1, 2, 3]


def test_units_are_converted_on_the_way():
    source = FakeComponent(
        outputs("y", unit=parse_unit("deg")), lambda _values, _t, _h: None, start={"y": 180.0}
    )
    sink = FakeComponent(
        [*inputs("u", unit=parse_unit("rad")), *outputs("y")],
        lambda v, _t, _h: v.update(y=v["u"]),
        start={},
    )
    recording = run_system(make_system({"a": source, "b": sink}, "a.y > b.u"), 1, 1, ["b.y"])
    assert recording.columns["b.y"][-1] == np.pi


def test_a_difference_has_no_offset():
    source = FakeComponent(
        outputs("y", unit=parse_unit("degC"), relative_quantity=True),
        lambda _values, _t, _h: None,
        start={"y": 1.5},
    )
    sink = FakeComponent(
        [*inputs("u", unit=parse_unit("K"), relative_quantity=True), *outputs("y")],
        lambda v, _t, _h: v.update(y=v["u"]),
    )
    assert (
        run_system(make_system({"a": source, "b": sink}, "a.y > b.u"), 1, 1, ["b.y"]).columns[
            "b.y"
        ][-1]
        == 1.5
    )


def test_integers_feed_reals_and_keep_their_own_type_in_the_recording():
    built = make_system({"a": counter(), "b": gain(0.5)}, "a.n > b.u", [("a",), ("b",)])
    recording = run_system(built, 3, 1, ["a.n", "b.y"])
    assert recording.columns["b.y"].tolist() == [0, 0.5, 1.0, 1.5]
    assert recording.columns["a.n"].dtype == np.int32


def test_strings_are_transferred():
    source = FakeComponent(
        [Variable("name", "String", "output"), *outputs("y")],
        lambda v, t, _h: v.update(name=f"step {t:g}"),
        start={"name": "-"},
    )
    sink = FakeComponent(
        [Variable("text", "String", "input"), Variable("copy", "String", "output")],
        lambda v, _t, _h: v.update(copy=v["text"]),
    )
    built = make_system({"a": source, "b": sink}, "a.name > b.text", [("a",), ("b",)])
    assert run_system(built, 2, 1, ["b.copy"]).columns["b.copy"].tolist() == [
        "",
        "step 0",
        "step 1",
    ]


def test_arrays_are_wired_element_by_element_and_keep_their_start_values_elsewhere():
    def step(values, _t, _h):
        values["sum"] = sum(values["u"])

    vector = FakeComponent(
        [Variable("u", causality="input", shape=(3,), start=(1.0, 10.0, 100.0)), *outputs("sum")],
        step,
    )
    built = make_system({"a": counter(), "b": vector}, "a.y > b.u[2]", [("a",), ("b",)])
    assert run_system(built, 2, 1, ["b.sum"]).columns["b.sum"].tolist() == [0, 102, 103]


def test_initial_outputs_reach_the_end_of_a_chain_before_the_first_step():
    components = {f"g{i}": gain(2.0) for i in range(4)} | {
        "source": FakeComponent(outputs("y"), lambda _v, _t, _h: None, start={"y": 1.0})
    }
    wires = "source.y > g3.u, g3.y > g2.u, g2.y > g1.u, g1.y > g0.u"
    recording = run_system(make_system(components, wires), 1, 1, ["g0.y"])
    assert recording.columns["g0.y"].tolist() == [16, 16]


def test_a_ring_that_starts_in_equilibrium_stays_there():
    built = make_system({"a": integrator(1.0), "b": gain(-0.0)}, "a.y > b.u, b.y > a.u")
    assert set(run_system(built, 100, 0.01, ["a.y"]).columns["a.y"]) == {1.0}


@pytest.mark.parametrize("wires", ["a.y > b.u, b.y > a.u", "a.y >1 b.u, b.y > a.u"])
def test_an_algebraic_loop_that_is_a_contraction_converges_in_initialization(wires):
    """Solve a = 1 - b / 2, b = 0.9 a."""
    one = FakeComponent(
        [*inputs("u"), *outputs("y")],
        lambda v, _t, _h: v.update(y=1 - v["u"] / 2),
        lambda v: v.update(y=1 - v["u"] / 2),
    )
    recording = run_system(make_system({"a": one, "b": gain(0.9)}, wires), 3, 1, ["a.y"])
    np.testing.assert_allclose(recording.columns["a.y"], 1 / 1.45, rtol=1e-11)


def test_an_early_return_is_an_error_with_the_time_reached():
    short = FakeComponent(outputs("y"), lambda _values, t, h: StepResult(t + h / 2))
    with pytest.raises(
        ComponentError, match=r"a: do_step failed at t = 0 s: reached only t = 0\.5 s of 1\.0 s"
    ):
        run_system(make_system({"a": short}), 1, 1)


@pytest.mark.parametrize(
    ("part", "rows"), [(1.0, [0, 1, 2, 3]), (0.5, [0, 1, 2])], ids=["complete", "incomplete"]
)
def test_the_macro_step_of_a_termination_request_counts_if_it_is_complete(part, rows):
    def step(values, t, h):
        values["y"] += 1
        return StepResult(t + part * h, terminate_requested=True) if t == 2 else None

    built = make_system({"a": FakeComponent(outputs("y"), step), "b": counter()})
    outcome = simulate(
        built,
        Settings(
            exact_fraction(0),
            exact_fraction(9),
            exact_fraction(1),
            {"a.y": endpoint("a.y"), "b.y": endpoint("b.y")},
        ),
    )
    assert (outcome.failure, outcome.termination.time) == (None, 2 + part)
    assert outcome.recording.time.tolist() == rows == outcome.recording.columns["a.y"].tolist()
    assert outcome.recording.columns["b.y"].tolist() == rows


def test_a_step_that_reaches_nan_is_an_error():
    faulty = FakeComponent(outputs("y"), lambda _values, _t, _h: StepResult(float("nan")))
    with pytest.raises(
        ComponentError, match="a: do_step failed at t = 0 s: reached only t = nan s"
    ):
        run_system(make_system({"a": faulty}), 1, 1)


class UnprintableError(Exception):
    def __str__(self):
        raise RuntimeError


class Panic(BaseException):
    """An exception outside Exception, as Rust libraries raise it."""


FAILURES = {
    "ValueError": (
        ValueError("too\x1b[31m steep"),
        r"ValueError: too\\x1b\[31m steep \(test_staged_algorithm.py:",
    ),
    "SystemExit": (SystemExit(0), "SystemExit: 0"),
    "no Exception": (Panic("index out of bounds"), "Panic: index out of bounds"),
    "text of no characters": (ValueError("\ud800"), r"ValueError: \\ud800"),
    "endless text": (ValueError("x" * 10**6), "x ... and 998000 characters more"),
    "no text": (UnprintableError(), "UnprintableError: "),
}


@pytest.mark.parametrize("name", FAILURES)
@pytest.mark.parametrize("method", ["do_step", "bind", "exit_initialization_mode"])
def test_an_exception_names_component_and_function(method, name):
    error, words = FAILURES[name]
    with pytest.raises(ComponentError) as failure:
        run_system(make_system({"a": counter(), "b": failing_counter(method, error)}), 1, 1)
    assert str(failure.value).startswith(f"b: {method} failed")
    assert re.search(words, str(failure.value))


@pytest.mark.parametrize("name", FAILURES)
@pytest.mark.parametrize("method", ["terminate", "free"])
def test_an_exception_after_the_last_step_is_a_warning(method, name, monkeypatch):
    error, words = FAILURES[name]
    messages = []
    monkeypatch.setattr(component_log, "log_message", lambda *message: messages.append(message))
    recording = run_system(make_system({"a": counter(), "b": failing_counter(method, error)}), 1, 1)
    assert len(recording.time) == 2
    ((component, level, text),) = messages
    assert (component, level) == ("b", component_log.WARNING)
    assert re.search(f"{method} failed: .*{words}", escape_control_characters(text))


def failing_counter(method, error):
    def fail(*_arguments):
        raise error

    failing = counter()
    setattr(failing, method, fail)
    return failing
