"""Runs paced to real time."""

import os
import signal
import time
from fractions import Fraction
from threading import Timer

import numpy as np
import pytest
from fakes import FakeComponent, counter, outputs
from systems import endpoint, make_system

import cosim.engine.pacer
from cosim.core.errors import InputError, LateError
from cosim.core.time_grid import TimeGrid, exact_fraction
from cosim.engine.pacer import Pacer
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

pytestmark = pytest.mark.usefixtures("executor")


def paced(component, stop, factor=1.0, **more):
    columns = {"a.y": endpoint("a.y")}
    settings = Settings(
        Fraction(0), exact_fraction(stop), exact_fraction("0.01"), columns, real_time=factor, **more
    )
    return simulate(make_system({"a": component}), settings)


def slow(seconds, steps):
    """Return a component whose first `steps` steps take `seconds` each."""

    def step(values, _t, _h):
        values["y"] += 1
        if values["y"] <= steps:
            time.sleep(seconds)

    return FakeComponent(outputs("y"), step)


@pytest.fixture
def clock(monkeypatch):
    """A fake clock, on which a sleep takes exactly the requested time."""

    class Clock:
        now, slept = 7_000_000_000, []

        def sleep(self, seconds):
            self.slept.append(seconds)
            self.now += round(seconds * 1e9)

        def monotonic_ns(self):
            return self.now

    fake = Clock()
    fake.slept = []
    monkeypatch.setattr(cosim.engine.pacer, "time", fake)
    return fake


def test_a_run_takes_as_long_as_it_simulates():
    run = paced(counter(), "0.3")
    assert 0.3 <= run.timing["loop_seconds"] < 3
    assert paced(counter(), "0.3", factor=10.0).timing["loop_seconds"] < run.timing["loop_seconds"]


def test_pacing_does_not_change_results():
    fast, real = (paced(counter(), "0.2", factor) for factor in (None, 20.0))
    assert real.recording.columns["a.y"].tolist() == fast.recording.columns["a.y"].tolist()
    assert fast.real_time is None


def test_deadlines_do_not_drift(clock):
    pacer = Pacer(TimeGrid.from_times(Fraction(0), Fraction(10**6), Fraction(1, 60)), 1.0, "warn")
    pacer.start()
    for n in range(1, 6001):
        clock.now += 1_000_000  # every step takes 1 ms
        pacer.wait(n)
    assert clock.now - 7_000_000_000 == pytest.approx(100e9, abs=1)


def test_lateness_is_measured_and_caught_up(clock):
    pacer = Pacer(TimeGrid.from_times(Fraction(0), Fraction(1), Fraction(1, 100)), 2.0, "warn")
    pacer.start()
    for n in range(1, 101):
        clock.now += 12_000_000 if n == 10 else 1_000_000
        pacer.wait(n)
    found = pacer.statistics()
    # one step of 12 ms in a slot of 5 ms is 7 ms late, the next ones need 1 ms each: 3 ms late,
    # then in time
    lateness = np.array([0.007, 0.003] + [0.0] * 98)
    assert (found["factor"], found["steps"], found["late_steps"]) == (2.0, 100, 2)
    assert found["max_lateness"] == pytest.approx(0.007)
    assert found["mean_lateness"] == pytest.approx(lateness.mean())
    assert found["lateness_99_percent"] == pytest.approx(np.percentile(lateness, 99))


def test_lateness_is_reported_once(caplog):
    run = paced(slow(0.03, 5), "0.2")
    assert run.failure is None
    (warning,) = [text for text in caplog.messages if text.startswith("real time: ")]
    assert warning.startswith("real time: t = 0.01 s was reached 0.")
    assert "late, more than one step (0.01 s)" in warning
    assert run.real_time["late_steps"] >= 5
    assert 0.02 < run.real_time["max_lateness"] < 5


def test_lateness_ends_the_run_if_late_is_fail():
    run = paced(slow(0.05, 100), "1", late="fail")
    assert isinstance(run.failure, LateError)
    assert str(run.failure).startswith("too slow for 1 times real time: t = 0.01 s was reached")
    assert run.recording.columns["a.y"].tolist() == [0, 1]


def test_an_interrupt_ends_the_waiting():
    Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    run = paced(counter(), "0.1", factor=0.001)  # 10 s per step
    assert isinstance(run.failure, KeyboardInterrupt)
    assert run.timing["loop_seconds"] < 8


@pytest.mark.parametrize("factor", [0.0, -1.0, float("inf"), float("nan")])
def test_an_invalid_factor_is_refused(factor):
    with pytest.raises(InputError, match="expected a positive factor for real time, found"):
        paced(counter(), "0.1", factor)


@pytest.mark.parametrize("factor", [5e-324, 1e-300, 1e-9])
def test_a_factor_that_lets_a_step_last_for_days_is_refused(factor):
    with pytest.raises(
        InputError,
        match=r"a step of 0\.01 s takes more than 1000000 s of wall time with the factor",
    ):
        paced(counter(), 1.0, factor)


@pytest.mark.parametrize("factor", [1e-7, 1e300, 1.7e308])
def test_extreme_factors_with_steps_of_hours_or_none_are_possible(factor):
    assert paced(counter(), 0.0 if factor < 1 else 1.0, factor).failure is None


def test_a_long_wait_is_made_of_several(monkeypatch):
    monkeypatch.setattr(cosim.engine.pacer, "_LONGEST_SLEEP", 10**6)
    began = time.monotonic()
    assert paced(counter(), 0.05).failure is None
    assert time.monotonic() - began >= 0.05
