"""Solver and tolerance of FMUs in scenarios and in `cosim.simulate`."""

from __future__ import annotations

import json

import pytest

import cosim


def scenario(folder, fmu, **component):
    file = folder / "s.json"
    content = {
        "name": "s",
        "stop_time": 0.5,
        "step_size": 0.01,
        "components": {"ball": {"fmu": str(fmu), **component}},
    }
    file.write_text(json.dumps(content))
    return file


SOLVERS = [
    ({}, {"method": "cvode", "tolerance": 1e-8}),
    ({"tolerance": 1e-4}, {"method": "cvode", "tolerance": 1e-4}),
    ({"solver": {"method": "rk4"}}, {"method": "rk4", "step_size": 0.01}),
    ({"solver": {"method": "euler", "step_size": 0.001}}, {"method": "euler", "step_size": 0.001}),
]


@pytest.mark.parametrize(("component", "solver"), SOLVERS)
def test_the_solver_of_a_component_is_used_and_recorded(component, solver, balls, tmp_path):
    result = cosim.run(scenario(tmp_path, balls[2], **component))
    (recorded,) = result.metadata["system"]["components"]
    assert recorded["solver"] == solver
    options = {
        "solver": solver["method"],
        "solver_step_size": solver.get("step_size"),
        "tolerance": solver.get("tolerance"),
    }
    alone = cosim.simulate(balls[2], stop_time=0.5, **options)
    assert alone["h"].tolist() == result["ball.h"].tolist()


REFUSED = [
    ({"solver": {"method": "heun"}}, '"heun"'),
    (
        {"solver": {"method": "cvode", "step_size": 0.1}},
        '"step_size" is for methods with fixed step size',
    ),
    ({"tolerance": 0}, "$.components.ball.tolerance"),
]


@pytest.mark.parametrize(("component", "words"), REFUSED)
def test_wrong_settings_are_refused_in_one_line(component, words, balls, tmp_path):
    with pytest.raises(cosim.InputError) as refusal:
        cosim.load(scenario(tmp_path, balls[2], **component))
    assert words in str(refusal.value)
    assert len(refusal.value.problems) == 1


def test_a_solver_for_an_fmu_without_model_exchange_is_refused(probe, tmp_path):
    with pytest.raises(
        cosim.InputError, match="has no interface for model-exchange, only for co-simulation"
    ):
        cosim.load(scenario(tmp_path, probe, solver={"method": "rk4"}))


def test_an_unknown_solver_is_refused_by_simulate(balls):
    with pytest.raises(cosim.InputError, match="one of euler, rk4, cvode"):
        cosim.simulate(balls[2], solver="heun")
