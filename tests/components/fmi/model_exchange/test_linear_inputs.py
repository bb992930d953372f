"""Inputs of Model Exchange FMUs that change linearly within a communication step: x' = u - x
follows a ramp u = t.
"""

from __future__ import annotations

import math
from fractions import Fraction

import pytest
from fakes import clock
from systems import endpoint, run_system

from cosim.components.fmi import (
    FmuFile,
    InstanceSettings,
    Isolation,
    SolverSettings,
    create_component,
)
from cosim.components.fmi.model_exchange import fixed_step
from cosim.core.integration_methods import METHODS
from cosim.core.system import Connection, System
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

pytestmark = pytest.mark.usefixtures("executor")


def ramp_system(
    path,
    method,
    step_size=None,
    isolation=None,
    fault=0,
    interpolation="linear",
    tolerance=None,
):
    settings = InstanceSettings(
        tolerance, SolverSettings(method, Fraction(step_size) if step_size else None)
    )
    parts = {"clock": clock(), "ball": create_component(FmuFile(path), "ball", settings, isolation)}
    ramp = Connection(
        endpoint("clock.y"), endpoint("ball.u"), gain=2.0, offset=1.0, interpolation=interpolation
    )
    return System(parts, [ramp], (("clock",), ("ball",)), start_values={"ball": {"fault": fault}})


def exact(time):
    """Return the solution of x' = 1 + 2 t - x that begins at 1."""
    return 2 * time - 1 + 2 * math.exp(-time)


def test_cvode_and_rk4_see_the_ramp_at_every_time(ball):
    for method, tolerance in (("cvode", 1e-6), ("rk4", 1e-9)):
        found = run_system(ramp_system(ball, method, "1/100"), 1, "0.1", ["ball.x"])
        assert found.columns["ball.x"] == pytest.approx(
            [exact(t) for t in found.time], abs=tolerance
        )
    held = run_system(
        ramp_system(ball, "rk4", "1/100", interpolation="hold"), 1, "0.1", ["ball.x"]
    ).columns["ball.x"]
    assert abs(held[-1] - exact(1)) > 0.03


@pytest.mark.parametrize("method", METHODS)
def test_every_method_hears_of_a_held_input_that_changes(ball, method):
    """In each step of 0.1 s the input is held, and x' = u - x has a closed solution."""
    system = ramp_system(ball, method, "1/10000", interpolation="hold", tolerance=1e-5)
    found = run_system(system, 1, "0.1", ["ball.x"]).columns["ball.x"]
    x = found[0]
    for n in range(10):
        held = 1 + 2 * (n + 1) / 10
        x = held + (x - held) * math.exp(-0.1)
        assert found[n + 1] == pytest.approx(x, abs=1e-4)


@pytest.mark.parametrize("compiled", [True, False], ids=["C", "Python"])
def test_eulers_method_uses_the_input_at_the_begin_of_each_of_its_steps(
    ball, compiled, monkeypatch
):
    if not compiled:
        monkeypatch.setattr(fixed_step, "_fixed_step", None)
    found, x = (
        run_system(ramp_system(ball, "euler", "1/40"), 1, "0.1", ["ball.x"])
        .columns["ball.x"]
        .tolist(),
        1.0,
    )
    for n in range(40):
        x += 0.025 * (1 + 2 * n / 40 - x)
    assert found[-1] == pytest.approx(x, rel=1e-14)


@pytest.mark.parametrize("method", ["rk4", "cvode"])
def test_a_separate_process_and_python_give_the_same_bits(ball, method, monkeypatch):
    here, isolated = (
        run_system(ramp_system(ball, method, "1/40", isolation), 1, "0.1", ["ball.x"])
        .columns["ball.x"]
        .tolist()
        for isolation in (None, Isolation())
    )
    monkeypatch.setattr(fixed_step, "_fixed_step", None)
    python = (
        run_system(ramp_system(ball, method, "1/40"), 1, "0.1", ["ball.x"])
        .columns["ball.x"]
        .tolist()
    )
    assert here == isolated == python


@pytest.mark.parametrize("method", ["rk4", "cvode", "euler"])
def test_an_input_that_the_fmu_refuses_is_named(ball, method):
    system = ramp_system(ball, method, "1/40", fault=1403)
    outcome = simulate(
        system, Settings(Fraction(0), Fraction(1), Fraction(1, 10), {"ball.x": endpoint("ball.x")})
    )
    name = "fmi3SetFloat64" if "3ME" in ball.stem else "SetReal"
    assert f"{name} failed at t = 0." in str(outcome.failure)
    assert "status 3 (error)" in str(outcome.failure)
    assert len(outcome.recording.time) >= 5
