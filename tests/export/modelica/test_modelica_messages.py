"""Messages of assertions: composed texts, and warnings in the log of the FMU."""

from __future__ import annotations

import shutil

import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import cosim
from cosim.core.errors import ComponentError
from cosim.export.build import build_to

MODEL = """model Guarded
  input Real u;
  parameter Real limit = 0.5;
  output Real y;
equation
  y = 2*u;
  assert(u < limit, "u is " + String(u) + ", above 100% of " + String(limit), \
AssertionLevel.warning);
  assert(u < 2, "u = " + String(u) + " is too large: " + String(u > 5));
end Guarded;"""


def test_a_message_contains_values(compile_both):
    model = compile_both(MODEL)
    model.initialize()
    model.set(u=2.5)
    assert model.c.step(0.0, 0.01) == "u = 2.5 is too large: false (Guarded.mo:8)"
    with pytest.raises(ComponentError, match=r"u = 2.5 is too large: false \(Guarded.mo:8\)"):
        model.python.step(0.0, 0.01)


def test_a_warning_is_logged_when_its_condition_becomes_false(write_model, tmp_path, capfd):
    fmu = build_to(write_model(MODEL), None, tmp_path / "guarded.fmu")
    description, folder = read_model_description(str(fmu)), extract(str(fmu))
    instance = FMU2Slave(
        guid=description.guid,
        unzipDirectory=folder,
        modelIdentifier=description.coSimulation.modelIdentifier,
        instanceName="guarded",
    )
    instance.instantiate(loggingOn=True)
    instance.setupExperiment()
    instance.enterInitializationMode()
    instance.exitInitializationMode()
    for k, value in enumerate([0.7, 0.8, 0.1, 0.9]):
        instance.setReal([0], [value])
        instance.doStep(k * 0.01, 0.01)
    instance.terminate()
    instance.freeInstance()
    shutil.rmtree(folder)
    lines = capfd.readouterr().out.splitlines()
    assert [line for line in lines if "WARNING" in line] == [
        "[WARNING] u is 0.7, above 100% of 0.5 (Guarded.mo:7)",
        "[WARNING] u is 0.9, above 100% of 0.5 (Guarded.mo:7)",
    ]


TIMER = """model Timer
  output Real y(start = 0, fixed = true);
equation
  der(y) = 2;
  when y > 0.513 then
    terminate("y has reached " + String(y));
  end when;
end Timer;"""


def test_terminate_in_an_algorithm_is_that_of_an_equation(write_model, tmp_path, caplog):
    algorithm = TIMER.replace("  when", "algorithm\n  when").replace("Timer", "Alarm")
    fmu = build_to(write_model(algorithm), None, tmp_path / "alarm.fmu", 3)
    with caplog.at_level("WARNING", "cosim.component"):
        result = cosim.simulate(fmu, stop_time=1.0, step_size=0.01)
    assert result.time[-1] == pytest.approx(0.26)
    assert caplog.messages == ["alarm: y has reached 0.513 (Alarm.mo:7)"]


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("solver", [None, "cvode"])
def test_terminate_ends_the_run_without_an_error(write_model, tmp_path, caplog, version, solver):
    """Co-Simulation ends after the communication step, Model Exchange before the one with the
    located event.
    """
    fmu = build_to(write_model(TIMER), None, tmp_path / f"timer{version}.fmu", version)
    with caplog.at_level("WARNING", "cosim.component"):
        result = cosim.simulate(
            fmu, stop_time=1.0, step_size=0.01, **({"solver": solver} if solver else {})
        )
    assert result.time[-1] == pytest.approx(0.26 if solver is None else 0.25, abs=1e-6)
    assert result["y"][-1] == pytest.approx(2 * result.time[-1], abs=1e-6)
    assert caplog.messages == ["timer: y has reached 0.513 (Timer.mo:5)"]
