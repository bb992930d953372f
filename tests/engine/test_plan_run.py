"""The run loop: life cycle, events, observers, failures, cleanup."""

import ctypes
import platform
import shutil
import struct
import sys
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction

import pytest
from fakes import FakeComponent, counter, gain, inputs, integrator, outputs
from systems import endpoint, make_system, run_system

from cosim.components.fmi import FmuFile, create_component
from cosim.core.component import StepResult, Variable
from cosim.core.errors import ComponentError, InputError
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan import compile_plan
from cosim.engine.plan_run import simulate
from cosim.engine.recorder import find_space_problems
from cosim.engine.settings import Event, Settings
from cosim.process.float_mode import enabled_traps, is_changed

pytestmark = pytest.mark.usefixtures("executor")


def settings(stop=3, step=1, record=("a.y",), **more):
    return Settings(
        Fraction(0),
        exact_fraction(stop),
        exact_fraction(step),
        {name: endpoint(name) for name in record},
        **more,
    )


def failing(at, failure):
    def step(values, t, _h):
        if t >= at:
            raise failure
        values["y"] += 1

    return FakeComponent(outputs("y"), step)


def test_the_life_cycle_calls_are_in_order():
    component = counter()
    simulate(make_system({"a": component}, start_values={"a": {"y": 5.0}}), settings())
    assert component.calls == [
        "set y",
        "enter",
        "exit",
        "step 0",
        "step 1",
        "step 2",
        "terminate",
        "free",
    ]


def test_row_zero_holds_the_initial_outputs_and_the_last_row_the_stop_time():
    recording = run_system(make_system({"a": counter()}), 3, 1, ["a.y"])
    assert recording.time.tolist() == [0, 1, 2, 3]
    assert recording.columns["a.y"].tolist() == [0, 1, 2, 3]


def test_the_record_interval_may_be_a_multiple_of_the_step_size():
    outcome = simulate(
        make_system({"a": counter()}), settings(6, record_interval=exact_fraction(3))
    )
    assert outcome.recording.time.tolist() == [0, 3, 6]
    assert outcome.recording.columns["a.y"].tolist() == [0, 3, 6]


def test_an_event_sets_values_before_the_step_that_starts_there():
    built = make_system({"a": integrator()})
    recording = run_system(built, 4, 1, ["a.y"], [Event(exact_fraction(2), {"a": {"u": 1.0}})])
    assert recording.columns["a.y"].tolist() == [0, 0, 0, 1, 2]


def test_an_event_after_the_stop_time_has_no_effect():
    recording = run_system(
        make_system({"a": integrator()}),
        2,
        1,
        ["a.y"],
        [Event(exact_fraction(3), {"a": {"u": 1.0}})],
    )
    assert recording.columns["a.y"].tolist() == [0, 0, 0]


def test_events_off_the_grid_or_on_variables_that_cannot_be_set_are_refused():
    fixed = Variable("k", causality="parameter", variability="fixed", start=1.0)
    a = FakeComponent([*inputs("u", "free"), *outputs("y"), fixed], lambda _values, _t, _h: None)
    events = [
        Event(exact_fraction(0.5), {"a": {"free": 1.0}}),
        Event(exact_fraction(1), {"a": {"u": 1.0, "k": 2.0}}),
    ]
    with pytest.raises(InputError) as refusal:
        simulate(make_system({"a": a, "b": gain()}, "b.y > a.u"), settings(events=events))
    assert [problem.message for problem in refusal.value.problems] == [
        "a.u is fed by a connection, an event cannot set it",
        "a.k is neither a tunable parameter nor an input, an event cannot set it",
        "event time 0.5 s lies between two communication points (1.0 s apart)",
    ]


def test_periods_must_fit_the_step_and_the_duration():
    built = make_system(
        {"a": counter(), "b": counter()}, periods={"a": exact_fraction(1.5), "b": exact_fraction(4)}
    )
    with pytest.raises(InputError) as refusal:
        simulate(built, settings())
    assert [problem.message for problem in refusal.value.problems] == [
        "period 1.5 s is no multiple of the step size 1.0 s",
        "the duration 3.0 s is shorter than the period of b: expected at least 4.0 s",
    ]


def test_a_step_longer_than_periods_is_one_problem():
    periods = dict.fromkeys("abcd", exact_fraction(0.01))
    built = make_system({name: counter() for name in "abcd"}, periods=periods)
    with pytest.raises(InputError) as refusal:
        simulate(built, replace(settings(), record_interval=exact_fraction(0.01)))
    (problem,) = refusal.value.problems
    fault = "step size 1.0 s is longer than the period of a, b, c and 1 more"
    assert problem.message == f"{fault}: expected 0.01 s or a whole fraction of it"
    assert problem.subject == ("step_size",)


def test_a_step_that_divides_no_period_is_one_problem_with_a_valid_step():
    """Events are compared with the valid step, which 1.5 s fits."""
    built = make_system(
        {name: counter() for name in "ab"},
        periods={"a": exact_fraction(3), "b": exact_fraction(4.5)},
    )
    changed = settings(
        stop=9, step=2, record_interval=exact_fraction(1.5), events=[Event(exact_fraction(1.5), {})]
    )
    for step, example in (
        (0.8, ", such as 0.75 s"),
        ("4/3", ", such as 0.75 s"),
        (0.7, ", such as 0.375 s"),
    ):
        with pytest.raises(InputError) as refusal:
            simulate(built, replace(changed, step_size=exact_fraction(step)))
        (problem,) = refusal.value.problems
        assert problem.message.endswith(
            f" s divides no period of a, b: expected 1.5 s or a whole fraction of it{example}"
        )
        assert problem.subject == ("step_size",)
    simulate(built, replace(changed, step_size=exact_fraction(0.75)))


def test_a_duration_shorter_than_periods_is_one_problem():
    built = make_system(
        {name: counter() for name in "ab"}, periods={"a": exact_fraction(4), "b": exact_fraction(5)}
    )
    with pytest.raises(InputError) as refusal:
        simulate(built, settings())
    (problem,) = refusal.value.problems
    assert (
        problem.message
        == "the duration 3.0 s is shorter than the period of a, b: expected at least 5.0 s"
    )
    assert problem.subject == ("stop_time",)


def test_a_refused_system_is_freed():
    component = counter()
    with pytest.raises(InputError):
        simulate(make_system({"a": component}), settings(stop="-1/3"))
    assert component.calls == ["free"]


def test_a_failure_keeps_earlier_rows_and_frees_all_components():
    a, b = failing(2, ComponentError("a", "do_step", "no more", 2.0)), counter()
    outcome = simulate(make_system({"a": a, "b": b}), settings(5))
    assert str(outcome.failure) == "a: do_step failed at t = 2 s: no more"
    assert outcome.recording.columns["a.y"].tolist() == [0, 1, 2]
    assert b.calls[-1] == "free"


def test_an_interrupt_keeps_earlier_rows():
    outcome = simulate(make_system({"a": failing(2, KeyboardInterrupt())}), settings(5))
    assert isinstance(outcome.failure, KeyboardInterrupt)
    assert outcome.recording.time.tolist() == [0, 1, 2]


def test_a_component_may_request_termination():
    def step(_values, t, h):
        return StepResult(t + h, terminate_requested=True) if t >= 1 else None

    outcome = simulate(
        make_system({"a": FakeComponent(outputs("y"), step), "b": counter()}),
        settings(5, record=["b.y"]),
    )
    assert outcome.termination == ("a", 2.0, True, None)
    assert outcome.recording.columns["b.y"].tolist() == [0, 1, 2]


def test_observers_see_progress_and_the_end():
    seen = []
    simulate(
        make_system({"a": counter()}),
        settings(1000),
        [lambda finished, total: seen.append((finished, total))],
    )
    assert seen[0] == (0, 1000)
    assert seen[-1] == (1000, 1000)
    assert len(seen) == 101


def test_a_recording_larger_than_the_disk_is_refused(tmp_path):
    with pytest.raises(
        InputError,
        match=r"3\d* rows of 1 signal take about .* GB are free in .*; make the step longer",
    ):
        simulate(make_system({"a": counter()}), settings(30, exact_fraction("1/1000000000000")))
    sparse = settings(30, exact_fraction("1/1000000000000"), record_interval=exact_fraction(30))
    plan = compile_plan(make_system({"a": counter()}), sparse)
    assert (plan.row_count, find_space_problems(plan, tmp_path, csv=True)) == (2, [])


@pytest.mark.parametrize(
    ("csv", "replaced", "fits"),
    [(False, 0.0, True), (True, 0.0, False), (True, 1.0, True), (True, 0.5, False)],
)
def test_the_free_space_is_that_of_the_folder_with_the_rows(tmp_path, csv, replaced, fits):
    """Rows of half the free space; with a CSV file they need 1.75 times of it."""
    free = shutil.disk_usage(tmp_path).free
    assert free > 2e9
    large = compile_plan(make_system({"a": counter()}), settings(free // 32, record=["a.y"]))
    assert (find_space_problems(large, tmp_path, csv, int(replaced * free)) == []) == fits


def flush_small_numbers(library):
    """Set two bits of the SSE control word, which is at byte 28 of fenv_t on Linux."""
    environment = ctypes.create_string_buffer(512)
    library.fegetenv(environment)
    (mode,) = struct.unpack_from("I", environment, 28)
    struct.pack_into("I", environment, 28, mode | 0x8040)
    library.fesetenv(environment)


def round_up(library):
    library.fesetround(0x0800)


def trap_division_by_zero(library):
    library.feenableexcept(0x04)


@contextmanager
def floating_point_mode(change):
    """Change the floating-point mode, like libraries that do so when they are imported."""
    library, before = ctypes.PyDLL(None), ctypes.create_string_buffer(512)
    library.fegetenv(before)
    change(library)
    try:
        yield
    finally:
        library.fesetenv(before)


@pytest.mark.skipif(
    (sys.platform, platform.machine()) != ("linux", "x86_64"), reason="numbers of <fenv.h>"
)
@pytest.mark.parametrize("change", [flush_small_numbers, round_up, trap_division_by_zero])
def test_results_do_not_depend_on_the_floating_point_mode_of_the_caller(probe, change):
    """No component is reported for it, and the caller's mode is restored afterwards."""

    def simulated_bytes():
        built = make_system(
            {"a": create_component(FmuFile(probe), "a")}, start_values={"a": {"u": 1 / 3}}
        )
        return run_system(built, 1, "1/10", ["a.y"]).columns["a.y"].tobytes()

    expected = simulated_bytes()
    with floating_point_mode(change):
        mode = is_changed(), enabled_traps()
        assert simulated_bytes() == expected
        assert (is_changed(), enabled_traps()) == mode != (False, 0)
    assert (is_changed(), enabled_traps()) == (False, 0)


def fixed_counter():
    component = counter()
    component.variable_step = False
    return component


def test_without_variable_steps_a_run_ends_at_the_last_common_end_of_all_steps():
    built = make_system(
        {"a": fixed_counter(), "b": fixed_counter()}, periods={"b": exact_fraction(2)}
    )
    plan = compile_plan(built, settings(stop=5.5))
    assert plan.grid.end == 4
    assert plan.end_warning == (
        "the run ends at t = 4 s, the last whole multiple of the step size 1 s and all periods "
        "before the stop time 5.5 s, "
        "because a, b cannot make a shorter step"
    )
    assert simulate(built, settings(stop=5.5)).recording.time.tolist() == [0, 1, 2, 3, 4]


def test_periods_whose_steps_never_end_together_are_refused():
    parts = {"a": fixed_counter(), "b": fixed_counter()}
    built = make_system(parts, periods={"a": exact_fraction(2), "b": exact_fraction(3)})
    with pytest.raises(InputError, match=r"end together only after 6\.0 s, after the stop time"):
        simulate(built, settings(stop=5))
