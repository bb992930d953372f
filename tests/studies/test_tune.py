"""Tuning of a lag with a known solution: y = (1 - h / T)^10 after ten Euler steps of h = 0.01 s."""

from __future__ import annotations

import json
import math

import pytest
from fault_fmu import lag_output
from lag_project import SEGV_ORDER

import cosim
from cosim.core.errors import InputError
from cosim.studies.execution.job import Record
from cosim.studies.execution.run_store import RunStore
from cosim.studies.tune import Tuning

PARAMETER = {"name": "T", "set": "lag.T", "min": 0.02, "max": 2.0, "scale": "log"}
SEARCH = {"kind": "nelder_mead", "evaluations": 25}
#: differential evolution with few generations
GENERATIONS = {"kind": "differential_evolution", "population": 6, "generations": 4, "seed": 1}
#: T at which y ends at a half and at a quarter of its start
HALF, QUARTER = 0.01 / (1 - 0.5**0.1), 0.01 / (1 - 0.25**0.1)


class InProcessRunner:
    """Runner that makes every run in this process."""

    def __init__(self, context):
        self.scenario, self.runs = context.scenario, 0

    def check(self, _job):
        return []

    def run_jobs(self, jobs):
        for job in jobs:
            self.runs += 1
            yield Record(job.key, dict(cosim.run(self.scenario, job.settings).kpis))


def with_kpis(lag, body):
    """Replace the scenario's KPIs by "own", which `body` computes from the last output y."""
    (lag.folder / "own.py").write_text(
        "from math import nan\n\ndef own(result):\n    y = result['lag.y'][-1]\n    return "
        f"{body}\n"
    )
    file = lag.folder / "lag.json"
    file.write_text(
        json.dumps(
            json.loads(file.read_text()) | {"kpis": [{"name": "own", "python": "own.py:own"}]}
        )
    )
    return lag


def tuned(lag, **content):
    """Run a tuning; return the best trial, all trials and the number of runs."""
    minimize = "abs(end.value - 0.5)"
    tuning = Tuning.from_file(
        lag.write(
            "tune", **{"parameters": [PARAMETER], "minimize": minimize, "method": SEARCH, **content}
        )
    )
    runner = InProcessRunner(tuning.study.context)
    with RunStore(lag.folder) as run_store:
        best = tuning.run(run_store, runner, lambda _record: None)
    return best, tuning.trials, runner.runs


@pytest.mark.parametrize("kind", ["nelder_mead", "powell", "differential_evolution"])
def test_the_minimum_is_found(lag, kind):
    method = {"kind": kind, "evaluations": 40, "population": 8, "generations": 6, "seed": 1}
    assert tuned(lag, method=method)[0].parameters["T"] == pytest.approx(HALF, rel=0.03)


def test_a_repeated_tuning_has_the_same_trials_and_makes_no_run(lag):
    best, trials, runs = tuned(lag)
    assert runs == len({trial.parameters["T"] for trial in trials}) > 10
    assert tuned(lag) == (best, trials, 0)


def test_the_start_is_tried_first(lag):
    _, trials, _ = tuned(lag, parameters=[PARAMETER | {"start": 0.4}])
    assert trials[0].parameters["T"] == pytest.approx(0.4, rel=1e-11)
    assert trials[0].value == pytest.approx(abs(lag_output(10, 1.0, 0.4) - 0.5), rel=1e-9)


def test_parameters_stay_within_their_bounds(lag):
    best, trials, _ = tuned(lag, minimize="0 - T", parameters=[PARAMETER | {"max": 1.1}])
    assert all(0.02 <= trial.parameters["T"] <= 1.1 for trial in trials)
    assert best.parameters["T"] == pytest.approx(1.1, rel=0.01)


def test_bounds_with_many_digits_are_not_rounded(lag):
    low = 0.7853981633974483
    _, trials, _ = tuned(
        lag, parameters=[PARAMETER | {"min": low, "start": low}], method=SEARCH | {"evaluations": 3}
    )
    assert min(trial.parameters["T"] for trial in trials) == low


def test_the_best_point_meets_the_constraints(lag):
    """The smallest final value that is not below 0.3 is 0.3."""
    method = {"kind": "differential_evolution", "population": 8, "generations": 6, "seed": 1}
    best, _, _ = tuned(lag, minimize="end.value", constraints=["end.value >= 0.3"], method=method)
    assert best.feasible
    assert 0.3 <= best.value < 0.32


def test_the_least_violation_is_best_when_no_point_is_feasible(lag):
    best, trials, _ = tuned(lag, constraints=["end.value >= 3"])
    assert not best.feasible
    assert (
        best.violation
        == min(trial.violation for trial in trials)
        == pytest.approx(3 - best.parameters["T"] ** 0, abs=0.2)
    )


@pytest.mark.parametrize("over", ["mean", "max"])
def test_the_objective_covers_all_cases(lag, over):
    """Only the second case has an error: the first evaluates the start value, which is correct."""
    cases = [{"/kpis/0/arguments/stop": 0.0, "lag.y_start": 0.5}, {"lag.y_start": 2.0}]
    best, _, _ = tuned(lag, cases=cases, over_cases=over)
    assert best.parameters["T"] == pytest.approx(QUARTER, rel=0.01)


@pytest.mark.parametrize("over", ["mean", "max"])
def test_a_nan_in_one_case_makes_the_value_of_the_point_nan(lag, over):
    """The second case has no value above 0.5, so the best point is just below."""
    with_kpis(lag, '{"y": float(y) if y <= 0.5 else nan}')
    content = {
        "minimize": "max(0, 1 - own.y)",
        "cases": [{"lag.y_start": 0.5}, {}],
        "over_cases": over,
    }
    best, trials, _ = tuned(lag, method=GENERATIONS, **content)
    assert any(math.isnan(trial.value) for trial in trials)
    assert 0.9 * HALF < best.parameters["T"] <= HALF


def test_a_search_continues_while_no_point_has_a_value(lag):
    """About one point in seven has a value; none of the first generation has."""
    with_kpis(lag, '{"y": float(y) if y < 0.05 else nan}')
    best, trials, _ = tuned(
        lag,
        minimize="own.y",
        parameters=[PARAMETER | {"start": 2.0}],
        method=GENERATIONS | {"seed": 17},
    )
    assert all(math.isnan(trial.value) for trial in trials[:6])
    assert best.feasible


def test_a_search_continues_while_all_violations_are_equal(lag):
    _, trials, _ = tuned(lag, minimize="end.value", constraints=["0 * T >= 1"], method=GENERATIONS)
    assert len(trials) == 6 * 5


def test_unknown_names_are_refused_after_the_first_points(lag):
    with pytest.raises(InputError) as refusal:
        tuned(lag, minimize="end.vlaue", constraints=["start >= 1"])
    first, second = map(str, refusal.value.problems)
    assert '$.minimize: no KPI or parameter "end.vlaue"; did you mean "end.value"?' in first
    assert '$.constraints[0]: no KPI or parameter "start"' in second


def test_a_kpi_that_few_runs_lack_has_no_value_there(lag):
    """A run that ends above 0.5 has another KPI."""
    with_kpis(lag, '{"low": float(y)} if y <= 0.5 else {"high": float(y)}')
    best, trials, _ = tuned(
        lag, minimize="1 - own.low", parameters=[PARAMETER | {"start": 1.0}], method=GENERATIONS
    )
    assert math.isnan(trials[0].value)
    assert best.feasible


def test_an_interrupt_in_the_first_generation_leaves_earlier_files_alone(lag, monkeypatch):
    file = lag.write(
        "tune", parameters=[PARAMETER], minimize="end.value", method=SEARCH | {"evaluations": 3}
    )
    assert lag.run_command("tune", file).code == 0
    before = lag.table("runs/tune", "trials.csv")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Tuning, "run", interrupted)
    assert lag.run_command("tune", file).code == 130
    assert lag.table("runs/tune", "trials.csv") == before


def test_the_command_prints_how_to_run_the_best_and_says_when_all_crash(lag):
    """Every point fails in its second case, so the first point is the best."""
    lag.write(
        "tune",
        parameters=[PARAMETER],
        minimize="end.value",
        cases=[{}, {"lag.fault": SEGV_ORDER}],
        method=SEARCH | {"evaluations": 3},
    )
    done = lag.run_command("tune", "tune.json")
    assert done.code == 1
    assert "a run failed at every point; at the first one: lag: fmi2DoStep failed" in done.err
    trials = lag.table("runs/tune", "trials.csv")
    assert all("SIGSEGV" in trial["failure"] for trial in trials)
    assert done.out.splitlines()[-1] == f"cosim run lag.json --set lag.T={trials[0]['T']}"


def test_the_command_says_when_no_point_has_a_value(lag):
    with_kpis(lag, '{"y": nan}')
    done = lag.run_command(
        "tune",
        lag.write(
            "tune", parameters=[PARAMETER], minimize="own.y", method=SEARCH | {"evaluations": 3}
        ),
    )
    assert (done.code, done.err) == (3, "own.y has no value at any point\n")
    assert "nan" not in done.out
    assert ["own.y", "-", "-"] in [line.split() for line in done.out.splitlines()]
    again = lag.run_command("tune", "tune.json", "--json")
    assert (again.code, json.loads(again.out)["failure"]) == (3, "own.y has no value at any point")


def test_json_is_the_content_of_the_file(lag):
    file = lag.write(
        "tune", parameters=[PARAMETER], minimize="end.value", method=SEARCH | {"evaluations": 3}
    )
    done = lag.run_command("tune", file, "--json")
    assert (done.code, done.err) == (0, "")
    written = json.loads((lag.folder / "runs/tune/best.json").read_text())
    assert json.loads(done.out) == {**written, "failure": None}
