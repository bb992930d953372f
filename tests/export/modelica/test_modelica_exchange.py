"""Modelica models as Model Exchange FMUs: FMPy and cosim integrate them to the results of
Co-Simulation.
"""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

import cosim
from cosim.export.fmu.package import write_fmu
from cosim.export.modelica import load_block

STOP, STEP = 1.2, 0.01

#: state events with reinit(), time events, a relation with the time, an array of states, delay()
#: and an input
MODEL = """block Bouncer
  parameter Real e = 0.7 "Restitution";
  input Real push(unit = "m/s2", start = 0);
  output Real h(start = 1, fixed = true, unit = "m");
  output Real v(start = 0, fixed = true, unit = "m/s");
  output Integer count(start = 0, fixed = true);
  output Boolean high;
  output Real late, sampled(start = 0, fixed = true), delayed;
protected
  Real x[2](start = {1, 0}, each fixed = true) "Oscillation";
equation
  der(h) = v;
  der(v) = -9.81 + push;
  der(x) = {x[2], -4*x[1]};
  high = h > 0.5;
  late = if time > 0.355 then x[1] else -x[1];
  delayed = delay(x[1], 0.1);
  when h < 0 then
    reinit(v, -e*pre(v));
    count = pre(count) + 1;
  end when;
  when sample(0.105, 0.25) then
    sampled = h;
  end when;
end Bouncer;"""
OUTPUTS = ("h", "v", "count", "high", "late", "sampled", "delayed")


@pytest.fixture(scope="module", params=[2, 3], ids=["fmi2", "fmi3"])
def fmu(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("exchange")
    source = folder / "Bouncer.mo"
    source.write_text(MODEL)
    return write_fmu(load_block(source), request.param, folder / f"bouncer{request.param}.fmu")


def simulate_with_fmpy(fmu: Path, interface: str) -> np.ndarray:
    return fmpy.simulate_fmu(
        str(fmu),
        fmi_type=interface,
        stop_time=STOP,
        output_interval=STEP,
        relative_tolerance=1e-9,
        output=OUTPUTS,
        start_values={"push": 1.0},
        record_events=False,
    )


def simulate_with_cosim(fmu: Path, solver: str | None) -> cosim.Result:
    settings = {"tolerance": 1e-9} if solver else {}
    return cosim.simulate(
        fmu,
        stop_time=STOP,
        step_size=STEP,
        start_values={"push": 1.0},
        output=OUTPUTS,
        solver=solver,
        **settings,
    )


def assert_equal_results(found, expected) -> None:
    assert max(expected["count"]) == 2
    for name in OUTPUTS:
        assert np.array(found[name], float) == pytest.approx(
            np.array(expected[name], float), abs=2e-5
        ), name


def test_fmpy_simulates_both_kinds_alike(fmu):
    assert_equal_results(
        simulate_with_fmpy(fmu, "ModelExchange"), simulate_with_fmpy(fmu, "CoSimulation")
    )


def test_cosim_simulates_both_kinds_alike(fmu):
    assert_equal_results(simulate_with_cosim(fmu, "cvode"), simulate_with_cosim(fmu, None))


def test_the_model_description_is_valid_and_complete(fmu):
    assert validate_fmu(str(fmu)) == []
    description = fmpy.read_model_description(str(fmu))
    assert description.numberOfEventIndicators == 3
    assert {
        v.name: v.derivative.name
        for v in description.modelVariables
        if v.derivative and "x" not in v.name
    } == {
        "der(h)": "h",
        "der(v)": "v",
    }
    assert description.modelExchange.needsCompletedIntegratorStep  # delay() stores values


def test_a_changing_input_changes_the_derivatives(fmu):
    """Between events the input is continuous in Model Exchange: h(1) of push = 9.81 + 6*t is 2."""
    values = np.array([(0.0, 9.81), (1.0, 15.81)], dtype=[("time", float), ("push", float)])
    result = fmpy.simulate_fmu(
        str(fmu), fmi_type="ModelExchange", stop_time=1.0, input=values, relative_tolerance=1e-8
    )
    assert result["h"][-1] == pytest.approx(
        2.0, abs=2e-3
    )  # FMPy holds the input over its integration steps
