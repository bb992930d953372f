"""Searches for the run that breaks a lag.

After ten Euler steps of h = 0.01 s it has y = (1 - h / T)^10.
"""

from __future__ import annotations

import csv
import json

import pytest
from lag_project import SEGV_ORDER

import cosim
from cosim.results.checks import evaluate_all_checks
from cosim.studies.worst_case import severity

TIME_CONSTANT = {"name": "T", "set": "lag.T", "min": 0.05, "max": 2.0}
METHOD = {"kind": "differential_evolution", "population": 6, "generations": 4, "seed": 1}
LIMITS = [{"kpi": "end.value", "max": 0.9, "min": 0.1}]


def written(lag, **content):
    return lag.write(
        "worst", **{"parameters": [TIME_CONSTANT], "success": LIMITS, "method": METHOD, **content}
    )


def test_the_largest_excess_is_found_and_kept_as_a_scenario_that_misses_the_check(lag):
    """The end value rises with T; at T = 2 s it is 0.951, 5.7 % above its limit, and at 0.05 s it
    is 0.107, within its limits.
    """
    done = lag.run_command("tune", "--worst", written(lag, keep=2), "--workers", "2")
    assert done.code == 3, done.err
    folder = lag.folder / "runs/worst"
    about = json.loads((folder / "worst.json").read_text())
    assert about["worst"]["parameters"]["T"] == pytest.approx(2.0, rel=0.1)
    assert about["worst"]["severity"] == pytest.approx((1 - 0.01 / 2) ** 10 / 0.9 - 1, abs=0.005)
    assert about["worst"]["reason"].startswith("end.value is 0.95")
    files = sorted((folder / "counterexamples").iterdir())
    assert [file.name for file in files] == ["worst_1.json", "worst_2.json"]
    assert json.loads(files[0].read_text())["extends"] == "../../../lag.json"
    result = cosim.run(files[0])
    assert not all(check.passed for check in result.checks)
    assert result.kpis["end.value"] == pytest.approx(0.9 * (1 + about["worst"]["severity"]))
    (outcome, _) = cosim.regress(folder / "counterexamples", output_dir=lag.folder / "regressed")
    assert outcome.code == 3
    with (folder / "trials.csv").open() as table:
        rows = list(csv.DictReader(table))
    assert len(rows) == about["runs"]
    assert {row["passed"] for row in rows} == {"0", "1"}


def test_no_counterexample_within_the_limits(lag):
    done = lag.run_command(
        "tune", "--worst", written(lag, success=[{"kpi": "end.value", "max": 0.99}])
    )
    assert done.code == 0, done.err
    assert "all checks passed; closest: end.value is 0.95" in done.out
    assert not (lag.folder / "runs/worst/counterexamples").exists()


def test_whole_numbers_are_searched_from_python(lag):
    found = cosim.worst_case(
        written(lag, parameters=[TIME_CONSTANT | {"min": 0.5, "max": 4.2, "whole": True}]),
        output_dir=lag.folder / "out",
        workers=1,
    )
    assert found.worst.parameters == {"T": 4}
    assert {each.parameters["T"] for each in found.attempts} <= {1, 2, 3, 4}
    assert found.counterexamples[0].is_file()


def test_multiples_are_searched_so_that_a_fault_falls_on_a_communication_point(make_lag):
    """The lag falls towards 0 until its input becomes 5; the later it does, the smaller is the end
    value.
    """
    lag = make_lag(events=[{"time": 0.05, "set": {"lag.u": 5.0}}])
    fault = {"name": "t", "set": "/events/0/time", "min": 0.005, "max": 0.098, "multiple_of": 0.01}
    found = cosim.worst_case(
        written(lag, parameters=[fault], success=[{"kpi": "end.value", "min": 2.0}]),
        output_dir=lag.folder / "out",
        workers=1,
    )
    assert {each.parameters["t"] for each in found.attempts} <= {n / 100 for n in range(1, 10)}
    assert all(each.severity < 10 for each in found.attempts)
    assert found.worst.parameters == {"t": 0.09}
    assert len({each.severity for each in found.attempts}) > 1


def test_a_failed_run_is_the_worst(make_lag):
    lag = make_lag(components={"lag": {"fmu": "lag.fmu", "parameters": {"fault": SEGV_ORDER}}})
    method = {"kind": "nelder_mead", "evaluations": 2}
    done = lag.run_command("tune", "--worst", written(lag, method=method), "--json")
    assert done.code == 3
    about = json.loads(done.out)
    assert about["worst"]["severity"] == 10
    assert "SIGSEGV" in about["worst"]["reason"]


def test_a_search_without_checks_and_one_with_unknown_kpis_are_refused(lag):
    done = lag.run_command("tune", "--worst", written(lag, success=[]))
    assert (done.code, done.err.strip()) == (
        2,
        'worst: nothing can break, expected "success" or checks of the scenario',
    )
    done = lag.run_command(
        "tune", "--worst", written(lag, success=[{"kpi": "ende.value", "max": 1}])
    )
    assert (done.code, lag.records("runs/worst")) == (2, [])
    assert '$.success[0].kpi: no KPI "ende.value"; did you mean "end.value"?' in done.err


@pytest.mark.parametrize(
    ("check", "value", "expected"),
    [
        ({"max": 2.0}, 3.0, 0.5),
        ({"max": 2.0}, 1.0, -0.5),
        ({"min": 2.0}, 1.0, 0.5),
        ({"min": 0.0}, -3.0, 3.0),
        ({"min": -1.0, "max": 1.0}, 0.5, -0.5),
        ({"max": 2.0}, 1e9, 10.0),
        ({"max": 2.0}, float("nan"), 1.0),
        ({"equals": True}, True, -1.0),
        ({"equals": True}, False, 1.0),
    ],
)
def test_the_severity_is_the_excess_as_a_fraction_of_the_limit(check, value, expected):
    (outcome,) = evaluate_all_checks({"k": value}, [{"kpi": "k", **check}])
    assert severity(outcome) == pytest.approx(expected)
