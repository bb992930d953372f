"""Event Mode and early return of FMI 3.0 Co-Simulation, with an FMU that refuses calls in a wrong
mode (foreign/bounce3.c).
"""

from __future__ import annotations

import logging
import math
from fractions import Fraction

import pytest
from fakes import FakeComponent
from probe_fmus import build_probe_fmu
from systems import endpoint, make_system, run_system

from cosim.components.fmi import (
    FmuFile,
    InstanceSettings,
    Isolation,
    SolverSettings,
    co_simulation,
    create_component,
)
from cosim.core.component import Variable
from cosim.core.errors import ComponentError
from cosim.core.system import Connection, Group, Iteration, System
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Event, Settings

pytestmark = pytest.mark.usefixtures("executor")
EVENT_MODE, EARLY = 'hasEventMode="true"', 'mightReturnEarlyFromDoStep="true"'
FLAGS = {
    "neither": "",
    "event mode": EVENT_MODE,
    "early return": EARLY,
    "both": f"{EVENT_MODE} {EARLY}",
}
SIGNALS = ["bounce.x", "bounce.h", "bounce.v", "bounce.count"]


@pytest.fixture(scope="session")
def bounces(tmp_path_factory):
    """Paths of the FMUs by their capabilities."""
    return {
        name: build_probe_fmu(
            3,
            tmp_path_factory.mktemp("bounce"),
            name="bounce3",
            flags=f'{flags} maxOutputDerivativeOrder="1"',
        )
        for name, flags in FLAGS.items()
    }


def bounce(path, isolation=None):
    return create_component(FmuFile(path), "bounce", isolation=isolation)


def recorded_rows(columns, names):
    """Return the rows of some columns as lists."""
    found = [columns[name].tolist() for name in names]
    return [list(row) for row in zip(*found, strict=True)]


def own_results(points, per_point):
    """Return x, h, v and count at the communication points, and the number of events, without
    cosim.
    """
    x, h, v, count, events, step, rows = 1.0, 1.0, 0.0, 0, 0, 1 / 1024, [[1.0, 1.0, 0.0, 0]]
    for n in range(1, points * per_point + 1):
        x, h, v = x + step * (0.0 - x), h + step * v, v - step * 9.81
        has_bounced, is_full = h <= 0 and v < 0, n * step >= 0.25 * (count + 1)
        events += has_bounced or is_full
        h, v = (0.0, v * -0.5) if has_bounced else (h, v)
        count += is_full
        if n % per_point == 0:
            rows.append([x, h, v, count])
    return rows, events


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
@pytest.mark.parametrize("flags", FLAGS)
def test_events_at_their_own_times_give_the_results_of_the_fmu_itself(bounces, flags, isolation):
    """Steps of 1/16 s contain events; steps that return early are continued."""
    system = make_system({"bounce": bounce(bounces[flags], isolation)})
    columns = run_system(system, 1, "1/16", [*SIGNALS, "bounce.events"]).columns
    rows, events = own_results(16, 64)
    assert recorded_rows(columns, SIGNALS) == rows
    # without early return only those at the ends of steps
    in_event_mode = {"both": events, "event mode": 4}
    assert columns["bounce.events"][-1] == in_event_mode.get(flags, 0)


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
@pytest.mark.parametrize("flags", FLAGS)
def test_discrete_inputs_are_set_in_event_mode_when_they_change(bounces, flags, isolation):
    def step(values, time, h):
        values["n"] = int(2 * (time + h))

    source = FakeComponent([Variable("n", "Int32", "output", "discrete")], step)
    parts = {"source": source, "bounce": bounce(bounces[flags], isolation)}
    system = make_system(parts, "source.n > bounce.i_in", [("source",), ("bounce",)])
    columns = run_system(system, 2, "0.125", ["bounce.i_out", "bounce.events", "source.n"]).columns
    if EVENT_MODE in FLAGS[flags]:
        assert columns["bounce.i_out"].tolist() == [10 * n for n in columns["source.n"]]
        own = (
            own_results(16, 128)[1] if flags == "both" else 8
        )  # of these, 4 in the steps after which the input changes
        assert columns["bounce.events"][-1] == own + 5
    else:
        assert columns["bounce.i_out"][-1] == 40


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
@pytest.mark.parametrize("flags", ["event mode", "early return", "both"])
def test_an_fmu_that_refuses_what_it_declares_runs_without_it(bounces, flags, isolation, caplog):
    component = create_component(FmuFile(bounces[flags]), "refusing", isolation=isolation)
    signals = [name.replace("bounce", "refusing") for name in SIGNALS]
    with caplog.at_level(logging.WARNING, "cosim"):
        columns = run_system(
            make_system({"refusing": component}), 1, "1/16", [*signals, "refusing.events"]
        ).columns
    rows, _ = own_results(16, 64)
    assert recorded_rows(columns, signals) == rows
    assert columns["refusing.events"][-1] == 0
    assert caplog.text.count("could only be instantiated without them") == 1


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
def test_an_early_return_that_is_not_declared_is_continued_after_its_event(
    bounces, isolation, caplog
):
    component = create_component(FmuFile(bounces["event mode"]), "undeclared", isolation=isolation)
    signals = [name.replace("bounce", "undeclared") for name in SIGNALS]
    with caplog.at_level(logging.WARNING, "cosim"):
        columns = run_system(
            make_system({"undeclared": component}), 1, "1/16", [*signals, "undeclared.events"]
        ).columns
    rows, events = own_results(16, 64)
    assert recorded_rows(columns, signals) == rows
    assert columns["undeclared.events"][-1] == events
    assert caplog.text.count("without declaring mightReturnEarlyFromDoStep") == 1


@pytest.mark.parametrize("flags", FLAGS)
def test_an_fmu_that_cannot_be_instantiated_gives_its_reason(bounces, flags):
    component = create_component(FmuFile(bounces[flags]), "impossible")
    with pytest.raises(
        ComponentError,
        match=r"^impossible: fmi3InstantiateCoSimulation failed: this is not supported$",
    ):
        run_system(make_system({"impossible": component}), 1, "1/16", ["impossible.x"])


@pytest.mark.parametrize("flags", ["event mode", "both"])
def test_tunable_parameters_are_set_in_event_mode_and_the_fmu_may_end_there(bounces, flags):
    change = Event(Fraction(3, 8), {"bounce": {"last_count": 3}})
    settings = Settings(
        Fraction(0),
        Fraction(2),
        Fraction(1, 8),
        {"bounce.count": endpoint("bounce.count")},
        events=[change],
    )
    outcome = simulate(make_system({"bounce": bounce(bounces[flags])}), settings)
    assert outcome.failure is None
    assert (outcome.termination.component, outcome.termination.time) == ("bounce", 0.75)
    assert outcome.recording.columns["bounce.count"].tolist()[-1] == 3


@pytest.mark.parametrize("flags", ["event mode", "both"])
def test_a_repeated_step_has_the_events_of_the_first_one(bounces, flags):
    group = Group("g", (("bounce",),), iteration=Iteration(1e-9, 10))
    repeated = run_system(
        make_system({"bounce": bounce(bounces[flags])}, stages=[(group,)]), 1, "1/16", SIGNALS
    )
    rows, _ = own_results(16, 64)
    assert recorded_rows(repeated.columns, SIGNALS) == rows


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
def test_derivatives_of_outputs_feed_a_model_exchange_fmu(bounces, balls, isolation):
    """x' = u - x is solved along the tangents of the height h of the ball in the other FMU."""
    solver = SolverSettings("rk4", Fraction(1, 512))
    parts = {"bounce": bounce(bounces["both"], isolation)}
    parts["ball"] = create_component(
        FmuFile(balls[2]), "ball", InstanceSettings(None, solver), isolation
    )
    tangent = Connection(endpoint("bounce.h"), endpoint("ball.u"), interpolation="linear")
    found = run_system(
        System(parts, [tangent], (("bounce", "ball"),)), 1, "1/16", ["ball.x"]
    ).columns["ball.x"]
    x, h = 1.0, 1 / 16
    for (_, height, speed, _), value in zip(own_results(16, 64)[0], found, strict=True):
        assert value == pytest.approx(x, abs=1e-12)
        x = height + speed * (h - 1) + (x - height + speed) * math.exp(-h)


#: fault -> words of the message
FAULTS = {
    1: (
        "fmi3UpdateDiscreteStates failed at t = 0.6875 s: the event iteration did not end after "
        "1000 calls"
    ),
    2: (
        "fmi3DoStep failed at t = 0.5625 s: more than 100 events in one communication step, the "
        "last one at t = 0.5"
    ),
    3: "fmi3DoStep failed at t = 0.5625 s: returned early at t = 0.5625 s without an event",
    4: (
        "fmi3DoStep failed at t = 0.6875 s: lastSuccessfulTime is nan s, expected at least the "
        "start of the step"
    ),
    5: (
        "fmi3DoStep failed at t = 0.6875 s: lastSuccessfulTime is -0.3125 s, expected at least the "
        "start of the step"
    ),
    6: "fmi3UpdateDiscreteStates failed at t = 0.6875 s: the next time event is at NaN",
    7: (
        "fmi3UpdateDiscreteStates failed at t = 0 s: the FMU requested termination in the initial "
        "event"
    ),
    103: "fmi3EnterEventMode failed at t = 0.6875 s: status 3 (error)",
    104: "fmi3EnterEventMode failed at t = 0.6875 s: status 4 (fatal)",
    203: "fmi3UpdateDiscreteStates failed at t = 0.6875 s: status 3 (error)",
    202: "fmi3UpdateDiscreteStates failed at t = 0.6875 s: status 2 (discard)",
    303: "fmi3EnterStepMode failed at t = 0.6875 s: status 3 (error)",
    377: "fmi3EnterStepMode failed at t = 0.6875 s: status 77 (not defined by FMI)",
    403: "fmi3DoStep failed at t = 0.875 s: status 3 (error)",
    402: "fmi3DoStep failed at t = 0.875 s: status 2 (discard)",
}


@pytest.mark.parametrize("fault", FAULTS)
def test_wrong_event_loops_end_in_one_line_and_keep_the_rows(bounces, fault, monkeypatch):
    monkeypatch.setattr(co_simulation, "MAX_EVENTS_PER_STEP", 100)
    outcome = run_with_fault(bounces["both"], fault)
    assert str(outcome.failure).startswith(f"bounce: {FAULTS[fault]}")
    assert len(str(outcome.failure).splitlines()) == 1
    assert len(outcome.recording.time) == {7: 0, 2: 10, 3: 10, 402: 15, 403: 15}.get(fault, 12)


@pytest.mark.parametrize(("code", "cause"), [(90, "SIGSEGV"), (91, "SIGABRT"), (92, "exit code 7")])
@pytest.mark.parametrize("function", [1, 2, 3, 4])
def test_crashes_in_event_mode_end_in_one_line_and_keep_the_rows(bounces, function, code, cause):
    outcome = run_with_fault(bounces["both"], 100 * function + code, Isolation())
    name = ("EnterEventMode", "UpdateDiscreteStates", "EnterStepMode", "DoStep")[function - 1]
    assert f"fmi3{name}" in str(outcome.failure)
    assert cause in str(outcome.failure)
    assert len(str(outcome.failure).splitlines()) == 1
    assert len(outcome.recording.time) == (15 if function == 4 else 12)


def test_an_event_after_every_internal_step_is_no_error(bounces):
    rows, _ = own_results(16, 64)
    outcome = run_with_fault(bounces["both"], 8)
    assert outcome.failure is None
    assert outcome.recording.columns["bounce.h"].tolist() == [row[1] for row in rows]


def run_with_fault(path, fault, isolation=None):
    system = make_system(
        {"bounce": bounce(path, isolation)}, start_values={"bounce": {"fault": fault}}
    )
    columns = {name: endpoint(name) for name in SIGNALS}
    return simulate(system, Settings(Fraction(0), Fraction(1), Fraction(1, 16), columns))
