"""Evaluation of KPIs and checks."""

import math

import numpy as np
import pytest

import cosim
from cosim.core.errors import ComponentError, InputError
from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.checks import evaluate_all_checks, evaluate_checks
from cosim.results.kpi import evaluate_kpis, kpi_units, units

RESULT = Result(Recording(np.array([0.0, 1.0, 2.0]), {"x": np.array([1.0, -4.0, 2.0])}, {"x": "m"}))


@units(largest="m", place="s")
def extent(result, signal, above=0.0):
    values = np.abs(result[signal])
    return {"largest": values.max(), "exceeds": values.max() > above, "rows": np.int32(len(values))}


def test_kpi_values_are_named_python_numbers():
    values = evaluate_kpis(
        RESULT, [("all", extent, {"signal": "x"}), ("high", extent, {"signal": "x", "above": 5})]
    )
    assert values == {
        **{"all.largest": 4.0, "all.exceeds": True, "all.rows": 3},
        **{"high.largest": 4.0, "high.exceeds": False, "high.rows": 3},
    }
    assert [type(value) for value in values.values()] == [float, bool, int] * 2


def test_units_are_declared_once_also_for_arrays():
    kpis = [("all", extent, {}), ("other", len, {})]
    assert kpi_units(kpis, ["all.largest", "all.place[2]", "all.rows", "other.x"]) == {
        "all.largest": "m",
        "all.place[2]": "s",
        "all.rows": "",
        "other.x": "",
    }


@pytest.mark.parametrize(
    ("declared", "unit", "expected"),
    [
        ("{signal}", "°C", "°C"),
        ("{signal}", "€/kWh", "€/kWh"),
        ("{signal}.s", "N·m", "N.m.s"),
        ("{signal}2.s", "bar_g", "bar_g2.s"),
        ("{signal}/s", "m", "m/s"),
        ("1/{signal}", "m", "1/m"),
        ("{signal}/{signal}", "m//", "1"),
        ("{signal} per 2 laps", "m", "{signal} per 2 laps"),
        ("{signal}.s", "", ""),
        ("{other}.s", "m", ""),
    ],
)
def test_units_may_depend_on_those_of_signals(declared, unit, expected):
    @units(value=declared)
    def kpi(result, signal): ...

    assert kpi_units([("x", kpi, {"signal": "y"})], ["x.value"], {"y": unit}) == {
        "x.value": expected
    }


def test_a_failing_kpi_is_named():
    def ratio(_result):
        return {"ratio": 1 / 0}

    with pytest.raises(
        ComponentError,
        match=(
            r'^KPI "speed": ratio failed: ZeroDivisionError: division by zero '
            r"\(test_kpi_evaluation.py:\d+\)$"
        ),
    ):
        evaluate_kpis(RESULT, [("speed", ratio, {})])


def test_a_kpi_whose_library_panics_is_named():
    def ratio(_result):
        raise BaseException("index out of bounds")

    with pytest.raises(
        ComponentError, match=r'^KPI "speed": ratio failed: BaseException: index out of bounds'
    ):
        evaluate_kpis(RESULT, [("speed", ratio, {})])


def test_an_unknown_signal_names_kpi_and_signal():
    with pytest.raises(InputError, match=r'^KPI "all": no signal "y" was recorded; valid: x$'):
        evaluate_kpis(RESULT, [("all", extent, {"signal": "y"})])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, r'^KPI "all": missing a required argument: .signal.$'),
        ({"sgnal": "x"}, r'^KPI "all": .*; did you mean "signal"\?$'),
        ({"signal": "x", "result": 1}, r'^KPI "all": multiple values for argument .result.'),
    ],
)
def test_wrong_arguments_are_refused_before_the_call(arguments, message):
    with pytest.raises(InputError, match=message):
        evaluate_kpis(RESULT, [("all", extent, arguments)])


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (0.5, 'KPI "bad": .* failed: returned float, expected a mapping from names to numbers'),
        ({"value": 10**400}, 'KPI "bad": .* failed: "value" is larger than any double'),
        ({"value": "high"}, 'KPI "bad": .* failed: "value" is str, expected a number or Boolean'),
        ({"value": np.array([1.0, 2.0])}, '"value" is ndarray, expected a number'),
        ({"value": None}, '"value" is NoneType, expected a number'),
    ],
)
def test_anything_but_numbers_is_refused(returned, message):
    with pytest.raises(ComponentError, match=message):
        evaluate_kpis(RESULT, [("bad", lambda _result: returned, {})])


@pytest.mark.parametrize(
    ("limits", "value", "passed"),
    [
        ({"max": 0.1}, 0.1, True),
        ({"max": 0.1}, 0.1000001, False),
        ({"min": 0.1}, 0.1, True),
        ({"min": 0.1}, 0.0999999, False),
        ({"min": 1, "max": 2}, 1.5, True),
        ({"min": 1, "max": 2}, 2.5, False),
        ({"equals": True}, True, True),
        ({"equals": True}, False, False),
        ({"equals": 3}, 3, True),
        ({"max": 0.1}, math.nan, False),
        ({"min": 0.1}, math.nan, False),
        ({"equals": math.nan}, math.nan, False),
    ],
)
def test_limits_include_their_own_value(limits, value, passed):
    check = {"kpi": "landing.error", **limits}
    assert evaluate_checks({"landing.error": value}, [check]) == [(check, value, passed)]


def test_all_bad_checks_are_refused_together():
    checks = [
        {"kpi": "landing.eror", "max": 1},
        {"kpi": "landing.error", "mx": 1},
        {"kpi": "landing.error"},
    ]
    with pytest.raises(InputError) as refused:
        evaluate_checks({"landing.error": 0.0}, checks)
    assert [str(problem) for problem in refused.value.problems] == [
        'check of "landing.eror": no such KPI; did you mean "landing.error"?',
        'check of "landing.error": unknown limit "mx"; did you mean "max"?',
        'check of "landing.error": no limit given, expected one of min, max, equals',
    ]


def test_a_check_of_a_missing_kpi_fails():
    """A result contains every check, also one with a misspelt name."""
    eror, error = evaluate_all_checks(
        {"landing.error": 0.0},
        [{"kpi": "landing.eror", "max": 1}, {"kpi": "landing.error", "max": 1}],
    )
    assert (eror.passed, error.passed) == (False, True)
    assert str(eror) == "landing.eror has no value, expected at most 1"


def test_repr_of_a_result_lists_failed_checks():
    result = cosim.run("demo1_box", stop_time=0.1)
    failed = {outcome.check["kpi"] for outcome in result.checks if not outcome.passed}
    assert len(result.checks) == 5
    assert "landing.landed_at_end" in failed
    assert "  landing.landed_at_end is false, expected true" in repr(result).splitlines()
