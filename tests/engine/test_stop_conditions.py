"""Conditions on recorded signals that end a simulation, in both executors."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from fakes import FakeComponent, outputs
from systems import endpoint, make_system

from cosim.core.component import StepResult, Variable
from cosim.core.expressions import parse_condition
from cosim.core.time_grid import exact_fraction
from cosim.engine import EXECUTORS, compile_plan
from cosim.engine.plan_run import PlanRun, SimulationOutcome, simulate
from cosim.engine.settings import Event, Settings, StopCondition


def series(values: list[float], crash_after: float = 1e9) -> FakeComponent:
    """A component whose output y at t = n/10 s is values[n]; `flag` is true from `crash_after` (s)
    on.
    """
    variables = [
        *outputs("y"),
        Variable("flag", "Boolean", "output"),
        Variable("gain", causality="input", start=1.0),
    ]

    def step(state: dict[str, Any], time: float, step_size: float) -> None:
        state["y"] = values[round((time + step_size) * 10)] * state["gain"]
        state["flag"] = time + step_size >= crash_after - 1e-9

    return FakeComponent(variables, step, start={"y": values[0], "flag": crash_after <= 0.0})


def stop(when: str, hold: float | str = 0, name: str = "end", **more: Any) -> StopCondition:
    return StopCondition(name, parse_condition(when), exact_fraction(hold), **more)


def run(
    component: FakeComponent,
    *stops: StopCondition,
    steps: int = 50,
    kind: Any = "auto",
    **more: Any,
) -> SimulationOutcome:
    columns = {name: endpoint(name) for name in ("a.y", "a.flag")}
    settings = Settings(
        Fraction(0),
        Fraction(steps, 10),
        Fraction(1, 10),
        columns,
        stop_conditions=stops,
        executor=kind,
        **more,
    )
    outcome = simulate(make_system({"a": component}), settings)
    assert outcome.failure is None
    return outcome


@pytest.mark.parametrize("kind", EXECUTORS)
def test_the_run_ends_with_the_row_at_which_a_condition_has_been_met_for_its_hold_time(
    kind: Any,
) -> None:
    values = [0, 1, 1, 0, 1, 1, 1, 1, 0, 0] * 6
    outcome = run(series(values), stop("a.y > 0.5", hold=0.3), kind=kind)
    assert outcome.termination is not None
    assert outcome.termination.condition is not None
    assert outcome.termination.condition._asdict() == {
        "condition": "end",
        "outcome": "decided",
        "cause": "a.y > 0.5",
        "since": 0.4,
        "time": 0.7,
    }
    assert outcome.recording.time[-1] == 0.7
    assert outcome.macro_steps == 7
    assert outcome.recording.columns["a.y"].tolist() == values[:8]


def first_end(values: list[float], hold: int, every: int) -> int | None:
    """Return the end by definition: the first recorded point that ends an uninterrupted series of
    `hold` steps or more.
    """
    begin = None
    for n in range(0, len(values), every):
        if values[n] <= 0:
            begin = None
        elif begin is None:
            begin = n
        if begin is not None and n - begin >= hold:
            return n
    return None


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("every", [1, 3])
def test_the_end_is_that_of_the_definition(kind: Any, every: int) -> None:
    generator = np.random.default_rng(every)
    for hold in (0, 1, 2, 3, 5, 8):
        values = generator.choice([0.0, 0.0, 1.0, 1.0, 1.0, 2.0], 61).tolist()
        settings = {"record_interval": Fraction(every, 10)}
        outcome = run(
            series(values), stop("a.y > 0", hold=f"{hold}/10"), steps=60, kind=kind, **settings
        )
        expected = first_end(values, hold, every)
        assert outcome.macro_steps == (60 if expected is None else expected)
        assert len(outcome.recording.time) == outcome.macro_steps // every + 1


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize(("hold", "times"), [(0, [0.0]), ("0.2", [0.0, 0.1, 0.2])])
def test_a_condition_can_be_met_at_the_start_of_the_run(
    kind: Any, hold: float | str, times: list[float]
) -> None:
    outcome = run(series([1.0] * 60), stop("a.y == 1", hold), kind=kind)
    assert outcome.termination is not None
    assert outcome.termination.condition == ("end", "decided", "a.y == 1", 0.0, times[-1])
    assert outcome.recording.time.tolist() == times


@pytest.mark.parametrize("kind", EXECUTORS)
def test_the_first_condition_to_end_counts_and_the_cause_names_what_was_met(kind: Any) -> None:
    stops = (
        stop("a.y > 20", name="far"),
        stop("a.flag or a.y < -1", hold=0.2, name="crash", outcome="crash"),
    )
    outcome = run(series([float(k) for k in range(60)], crash_after=1.2), *stops, kind=kind)
    assert outcome.termination is not None
    assert outcome.termination.condition == ("crash", "crash", "a.flag", 1.2, 1.4)


@pytest.mark.parametrize("kind", EXECUTORS)
def test_a_condition_without_a_value_is_not_met(kind: Any) -> None:
    outcome = run(series([0.0] * 60), stop("1 / a.y > 0"), stop("not (1 / a.y > 0)"), kind=kind)
    assert (outcome.macro_steps, outcome.termination) == (50, None)


@pytest.mark.parametrize("kind", EXECUTORS)
def test_the_end_comes_before_an_event_at_the_same_point(kind: Any) -> None:
    component = series([0.0, 0.0, 1.0] + [0.0] * 60)
    run(
        component, stop("a.y > 0"), kind=kind, events=[Event(Fraction(2, 10), {"a": {"gain": 5.0}})]
    )
    assert "set gain" not in component.calls


@pytest.mark.parametrize("kind", EXECUTORS)
def test_runs_in_single_steps_end_at_the_same_point(kind: Any) -> None:
    settings = {"real_time": 1000.0}
    outcome = run(series([0.0] * 10 + [1.0] * 60), stop("a.y > 0", hold=0.5), kind=kind, **settings)
    assert outcome.macro_steps == 15


@pytest.mark.parametrize("kind", EXECUTORS)
def test_the_request_of_a_component_at_the_same_point_counts(kind: Any) -> None:
    component = series([0.0, 1.0, 1.0])
    component._step = lambda _values, time, step: StepResult(time + step, terminate_requested=True)
    outcome = run(component, stop("a.y >= 0", hold=0.1), kind=kind)
    assert outcome.termination == ("a", 0.1, True, None)


@pytest.mark.parametrize("kind", EXECUTORS)
@pytest.mark.parametrize("saved_at", [3, 6, 8])
def test_a_restored_run_ends_at_the_same_point(kind: Any, saved_at: int) -> None:
    """The condition has been met since point 5; the run ends at point 9, also after a later end was
    undone.
    """
    component = series([0.0] * 5 + [1.0] * 60)
    columns = {name: endpoint(name) for name in ("a.y", "a.flag")}
    stops = [stop("a.y > 0", hold=0.4)]
    settings = Settings(
        Fraction(0), Fraction(5), Fraction(1, 10), columns, stop_conditions=stops, executor=kind
    )
    simulation = PlanRun(compile_plan(make_system({"a": component}), settings))
    try:
        simulation.initialize()
        simulation.advance(saved_at)
        state = simulation.save()
        for _ in range(2):
            simulation.advance(50)
            assert simulation.executor.completed_steps == 9
            assert simulation.executor.termination is not None
            simulation.restore(state)
            assert simulation.executor.termination is None
    finally:
        simulation.close()


def random_term(random: np.random.Generator, depth: int = 0) -> str:
    """Return an arithmetic expression of signals; some have no value, as after a division by zero
    or an overflow.
    """
    kind = "name" if depth > 3 else random.choice(["name", "number", "binary", "unary", "call"])
    first, second = (
        random_term(random, depth + 1) if kind in ("binary", "unary", "call") else ""
        for _ in range(2)
    )
    if kind == "name":
        return str(random.choice(["a.y", "a.flag", "a.n"]))
    if kind == "number":
        return str(random.choice(["0", "1", "2.5", "0.1", "1e200", "9" * 20]))
    if kind == "binary":
        return f"({first} {random.choice(['+', '-', '*', '/', '**'])} {second})"
    if kind == "unary":
        return f"({random.choice(['-', '+'])}{first})"
    call = str(random.choice(["abs", "sqrt", "exp", "log", "min", "max", "log_to_base"]))
    arguments = f"{first}, {second}" if call in ("min", "max", "log_to_base") else first
    return f"{call.removesuffix('_to_base')}({arguments})"


def random_condition(random: np.random.Generator, depth: int = 0) -> str:
    kind = (
        "comparison"
        if depth > 2
        else random.choice(["comparison", "chain", "and", "or", "not", "term"])
    )
    if kind in ("and", "or"):
        parts = [random_condition(random, depth + 1) for _ in range(random.integers(2, 4))]
        return f"({f' {kind} '.join(parts)})"
    if kind == "not":
        return f"(not {random_condition(random, depth + 1)})"
    operators = ["<", "<=", ">", ">=", "==", "!="]
    terms = [random_term(random) for _ in range({"term": 1, "chain": 3}.get(kind, 2))]
    return "".join(f"{term} {random.choice(operators)} " for term in terms[:-1]) + terms[-1]


@pytest.mark.parametrize("seed", range(8))
def test_conditions_are_met_at_the_same_points_in_both_executors(seed: int) -> None:
    """Random conditions of a real, a Boolean and an integer signal; NaN where Python raises an
    exception, as defined.
    """
    random = np.random.default_rng(seed)
    variables = [
        *outputs("y"),
        Variable("flag", "Boolean", "output"),
        Variable("n", "Int32", "output"),
    ]
    rows = [
        {
            "y": float(random.choice([0.0, 1.0, -1.0, 2.0, 0.5, 1e3])),
            "flag": bool(random.integers(2)),
            "n": int(random.integers(-2, 3)),
        }
        for _ in range(31)
    ]

    def step(state: dict[str, Any], time: float, step_size: float) -> None:
        state.update(rows[round((time + step_size) * 10)])

    texts = [random_condition(random) for _ in range(12)]
    columns = {name: endpoint(name) for name in ("a.y", "a.flag", "a.n")}
    met = {}
    for kind in EXECUTORS:
        for text in texts:
            stops = [stop(f"({text}) and (a.y + a.n) != 77", hold="2/10")]
            settings = Settings(
                Fraction(0),
                Fraction(3),
                Fraction(1, 10),
                columns,
                stop_conditions=stops,
                executor=kind,
            )
            outcome = simulate(
                make_system({"a": FakeComponent(variables, step, start=rows[0])}), settings
            )
            end = outcome.termination.condition if outcome.termination else None
            met.setdefault(text, []).append((outcome.macro_steps, end))
    assert {text: len(set(found)) for text, found in met.items()} == dict.fromkeys(texts, 1)


def test_random_conditions_are_met_now_and_then() -> None:
    """The conditions of the test above are met in some runs and not in others."""
    values = {"a.y": 0.5, "a.flag": 1.0, "a.n": -1.0}
    found = [
        parse_condition(random_condition(np.random.default_rng(seed)))(values)
        for seed in range(200)
    ]
    shares = np.mean([not value or np.isnan(value) for value in found]), np.isnan(found).mean()
    assert 0.3 < shares[0] < 0.8
    assert 0.05 < shares[1] < 0.5
