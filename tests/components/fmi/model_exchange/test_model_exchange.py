"""Model Exchange FMUs: integration, events, inputs, states and failures."""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from fakes import FakeComponent, clock, outputs
from systems import endpoint, make_system, run_system

from cosim.components.fmi import (
    FmuFile,
    InstanceSettings,
    Isolation,
    SolverSettings,
    create_component,
    model_exchange,
)
from cosim.components.fmi.model_exchange import fixed_step
from cosim.core.component import Variable
from cosim.core.errors import ComponentError, InputError
from cosim.core.system import Group, Iteration
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Event, Settings

pytestmark = pytest.mark.usefixtures("executor")
SIGNALS = ["ball.x", "ball.h", "ball.v", "ball.count", "ball.i_out"]


def component(path, method="cvode", step_size=None, tolerance=None, isolation=None):
    settings = InstanceSettings(
        tolerance, SolverSettings(method, exact_fraction(step_size) if step_size else None)
    )
    return create_component(FmuFile(path), "ball", settings, isolation)


def columns(recording):
    return {
        name.removeprefix("ball."): values.tolist() for name, values in recording.columns.items()
    }


def exact_ball(time, height=1.0, restitution=0.7, gravity=9.81):
    """Return height and velocity of a ball that is dropped at time 0."""
    begin, velocity = 0.0, 0.0
    while True:
        flight = (velocity + math.sqrt(velocity**2 + 2 * gravity * height)) / gravity
        if time < begin + flight:
            t = time - begin
            return height + velocity * t - gravity * t**2 / 2, velocity - gravity * t
        begin, height, velocity = begin + flight, 0.0, -restitution * (velocity - gravity * flight)


def reference_run(method, steps, h):
    """Return x, h and v after each step of a fixed-step method with events."""
    states, slope = [1.0, 1.0, 0.0], -9.81
    rows = [list(states)]

    def derivatives(s):
        return [0.0 - s[0], s[2], slope]

    for _ in range(steps):
        k1 = derivatives(states)
        if method == "euler":
            new = [s + h * k for s, k in zip(states, k1, strict=True)]
        else:
            k2 = derivatives([s + 0.5 * h * k for s, k in zip(states, k1, strict=True)])
            k3 = derivatives([s + 0.5 * h * k for s, k in zip(states, k2, strict=True)])
            k4 = derivatives([s + h * k for s, k in zip(states, k3, strict=True)])
            slopes = zip(k1, k2, k3, k4, strict=True)
            new = [
                s + (h / 6.0) * (a + 2.0 * b + 2.0 * c + d)
                for s, (a, b, c, d) in zip(states, slopes, strict=True)
            ]
        states = new
        if states[1] <= 0 and states[2] < 0:
            states[1], states[2] = 0.0, states[2] * -0.7
        rows.append(list(states))
    return rows


@pytest.mark.parametrize("method", ["euler", "rk4"])
@pytest.mark.parametrize("compiled", [True, False], ids=["C", "Python"])
def test_a_fixed_step_method_makes_the_steps_of_its_definition(ball, method, compiled, monkeypatch):
    if not compiled:
        monkeypatch.setattr(fixed_step, "_fixed_step", None)
    recording = run_system(
        make_system({"ball": component(ball, method, "1/1000")}), 2, "1/100", SIGNALS
    )
    rows = reference_run(method, 2000, 0.001)[::10]
    found = [columns(recording)[name] for name in "xhv"]
    assert [list(row) for row in zip(*found, strict=True)] == rows
    assert columns(recording)["count"][-1] == 8


def test_connected_inputs_and_outputs_belong_to_the_fmu_and_steps_to_its_integrator(ball):
    """x' = u - x with u = t of the start of the step; after three steps the native executor makes
    steps in compact form.
    """
    system = make_system(
        {"ball": component(ball, "euler", "0.1"), "clock": clock()}, "clock.y > ball.u"
    )
    found, x = columns(run_system(system, "0.9", "0.1", ["ball.x"]))["x"], 1.0
    for n, value in enumerate(found):
        assert value == pytest.approx(x, rel=1e-14)
        x += 0.1 * (n / 10 - x)


def test_the_step_size_of_a_method_divides_the_communication_step(ball):
    recording = run_system(
        make_system({"ball": component(ball, "euler", "0.004")}), "0.01", "0.01", SIGNALS
    )
    assert columns(recording)["x"][-1] == reference_run("euler", 3, float(Fraction(1, 300)))[-1][0]


def test_without_a_step_size_that_of_the_default_experiment_is_used(balls):
    recording = run_system(
        make_system({"ball": component(balls[2], "euler")}), "0.1", "0.05", SIGNALS
    )
    assert columns(recording)["x"][-1] == reference_run("euler", 10, 0.01)[-1][0]


@pytest.mark.parametrize("step", ["1/100", "1/3"])
def test_cvode_follows_the_exact_solution_through_the_events(ball, step):
    recording = run_system(make_system({"ball": component(ball)}), 2, step, SIGNALS)
    for time, x, h, v in zip(
        recording.time, *(columns(recording)[name] for name in "xhv"), strict=True
    ):
        assert x == pytest.approx(math.exp(-time), abs=3e-7)
        assert (h, v) == pytest.approx(exact_ball(time), abs=1e-5)
    assert columns(recording)["count"] == [int(time * 4 + 1e-9) for time in recording.time]


def test_a_smaller_tolerance_gives_a_smaller_error(ball):
    errors = []
    for tolerance in (1e-3, 1e-6, 1e-9):
        recording = run_system(
            make_system({"ball": component(ball, tolerance=tolerance)}), 1, "0.1", SIGNALS
        )
        errors.append(abs(columns(recording)["x"][-1] - math.exp(-1)))
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-8


@pytest.mark.parametrize("method", ["cvode", "euler"])
def test_the_fmu_ends_the_simulation_at_a_time_event(ball, method):
    system = make_system(
        {"ball": component(ball, method)}, start_values={"ball": {"last_count": 3}}
    )
    outcome = simulate(
        system,
        Settings(
            Fraction(0), Fraction(2), Fraction(1, 100), {"ball.count": endpoint("ball.count")}
        ),
    )
    assert (outcome.termination.component, outcome.termination.time) == ("ball", 0.75)
    assert outcome.recording.columns["ball.count"].tolist()[-1] == 3


@pytest.mark.parametrize("method", ["cvode", "euler"])
def test_inputs_act_at_once_and_discrete_ones_at_events(ball, method):
    def step(values, time, h):
        values["y"], values["n"] = 2.0 * (time + h), int(10 * (time + h) + 1e-9)

    source = FakeComponent([*outputs("y"), Variable("n", "Int32", "output", "discrete")], step)
    wired = make_system(
        {"source": source, "ball": component(ball, method, "0.01")},
        "source.y > ball.u, source.n > ball.i_in",
        [("source",), ("ball",)],
    )
    recording = columns(run_system(wired, 1, "0.1", SIGNALS))
    assert recording["i_out"][1:] == [10 * n for n in range(1, 11)]
    x, expected = 1.0, [1.0]
    for n in range(1, 11):
        u = 0.2 * n
        for _ in range(10):
            x = u + (x - u) * math.exp(-0.01) if method == "cvode" else x + 0.01 * (u - x)
        expected.append(x)
    assert recording["x"] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("version", [2, 3])
def test_parameters_and_inputs_are_set_during_the_run(balls, version):
    ball = balls[version]
    events = [Event(Fraction(1, 10), {"ball": {"restitution": 0.5, "u": 1.0, "i_in": 7}})]
    recording = columns(
        run_system(make_system({"ball": component(ball)}), "0.6", "0.1", SIGNALS, events)
    )
    assert recording["x"][-1] == pytest.approx(1 + (math.exp(-0.1) - 1) * math.exp(-0.5), abs=1e-6)
    assert recording["i_out"] == [0, 0, 70, 70, 70, 70, 70]
    assert (recording["h"][-1], recording["v"][-1]) == pytest.approx(
        exact_ball(0.6, restitution=0.5), abs=1e-6
    )


@pytest.mark.parametrize("method", ["cvode", "rk4"])
def test_a_separate_process_gives_the_same_results(ball, method):
    isolated = component(ball, method, isolation=Isolation())
    found, expected = (
        run_system(make_system({"ball": c}), 1, "0.1", SIGNALS)
        for c in (isolated, component(ball, method))
    )
    assert columns(found) == columns(expected)


@pytest.mark.parametrize("method", ["cvode", "euler"])
@pytest.mark.parametrize("version", [2, 3])
def test_a_repeated_step_begins_at_the_saved_state(balls, version, method):
    ball = balls[version]
    group = Group("g", (("ball",),), iteration=Iteration(1e-9, 10))
    repeated = run_system(
        make_system({"ball": component(ball, method)}, stages=[(group,)]), 1, "0.1", SIGNALS
    )
    plain = run_system(make_system({"ball": component(ball, method)}), 1, "0.1", SIGNALS)
    for name in SIGNALS:
        assert repeated.columns[name] == pytest.approx(plain.columns[name], abs=1e-6)


#: fault of the FMU -> method and part of the message
FAULTS = {
    (1, "cvode"): "Derivatives failed at t = 0.5 s: status 3 (error)",
    (1, "euler"): "Derivatives failed at t = 0.51 s: status 3 (error)",
    (2, "cvode"): "GetEventIndicators failed at t = 0.5 s: event indicator 1 is NaN",
    (2, "euler"): "GetEventIndicators failed at t = 0.5 s: event indicator 1 is NaN",
    (3, "cvode"): " failed at t = 0 s: the event iteration did not end after 1000 calls",
    (4, "cvode"): "events in one communication step, the last one at t = 0.25 s",
    (4, "euler"): None,
    (6, "cvode"): "Derivatives failed at t = 0.5 s: status 2 (discard)",
    (6, "rk4"): "Derivatives failed at t = 0.5 s: status 2 (discard)",
    (7, "cvode"): "more than 100 events in one communication step",
    (7, "euler"): None,
    (8, "cvode"): None,
}


@pytest.mark.parametrize(("fault", "method"), FAULTS)
def test_a_failure_names_function_time_and_cause_and_keeps_the_rows(
    ball, fault, method, monkeypatch
):
    monkeypatch.setattr(model_exchange, "MAX_EVENTS_PER_STEP", 100)
    system = make_system(
        {"ball": component(ball, method)},
        start_values={"ball": {"fault": fault, "last_count": 10**6}},
    )
    outcome = simulate(
        system, Settings(Fraction(0), Fraction(1), Fraction(1, 100), {"ball.x": endpoint("ball.x")})
    )
    message = FAULTS[fault, method]
    if message is None:
        assert outcome.failure is None
        return
    assert isinstance(outcome.failure, ComponentError)
    assert message in str(outcome.failure)
    assert len(str(outcome.failure).splitlines()) == 1
    rows = {3: 0, 4: 26, 7: 1}.get(fault, 52 if method == "euler" and fault == 1 else 51)
    assert len(outcome.recording.time) == rows


def test_a_solver_for_an_fmu_without_model_exchange_is_refused(probe):
    with pytest.raises(
        InputError, match="has no interface for model-exchange, only for co-simulation"
    ):
        _ = FmuFile(probe, interface="model-exchange").description
