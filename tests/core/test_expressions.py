"""Expressions of named values."""

import math
import re

import pytest

from cosim.core.expressions import parse_condition, parse_expression

VALUES = {
    "landing.error": 0.5,
    "waypoints.time[2]": 8.0,
    "gain": 3.0,
    "flown": True,
    "lost": math.nan,
}


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("landing.error", 0.5),
        ("2 * landing.error + waypoints.time[2] / 4 - -gain", 6.0),
        ("2 + 3 * gain ** 2", 29.0),
        ("max(gain, 5) - min(gain, 5, 1) + abs(-2)", 6.0),
        ("sqrt(16) + log(exp(1))", 5.0),
        ("1 - flown", 0.0),
    ],
)
def test_arithmetic(text, value):
    assert parse_expression(text)(VALUES) == pytest.approx(value)


@pytest.mark.parametrize(
    "text", ["1 / (gain - 3)", "sqrt(-gain)", "log(0)", "1e300 ** 2", "(-8) ** 0.5", "missing + 1"]
)
def test_an_undefined_expression_is_nan(text):
    assert math.isnan(parse_expression(text)(VALUES))


@pytest.mark.parametrize(
    "text", ["max(0, lost)", "min(lost, 1)", "lost ** 0", "1 ** lost", "min(1, max(lost, 2))"]
)
def test_nan_in_any_part_makes_the_expression_nan(text):
    """Python's `min`, `max` and `**` drop some NaN, depending on the order of arguments."""
    assert math.isnan(parse_expression(text)(VALUES))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("__import__('os').system('true')", "is not allowed here"),
        ("().__class__", "is not allowed here"),
        ("gain if gain else 1", "is not allowed here"),
        ("[gain]", "is not allowed here"),
        ("'text'", "is not allowed here"),
        ("True", "is not allowed here"),
        ("lambda: 1", "is not allowed here"),
        ("gain // 2", "is not allowed here"),
        ("maxi(gain, 1)", 'unknown function "maxi"; did you mean "max"?'),
        ("max(*gain)", "is not allowed here"),
        ("abs(gain, 2)", '"abs" takes 1 argument, found 2'),
        ("min(gain)", '"min" takes 2 arguments or more, found 1'),
        ("log(gain, 2, 3)", '"log" takes 1 or 2 arguments, found 3'),
        ("gain +", "is not an expression"),
        ("(" * 300 + "1" + ")" * 300, "is not an expression"),
        ("1 + " * 400 + "1", "at most 1000 characters"),
    ],
)
def test_other_syntax_is_refused(text, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        parse_expression(text)


def test_an_unknown_name_is_reported_with_the_nearest_one():
    assert (
        parse_expression("gian + 1").unknown_name_problem(VALUES)
        == 'no KPI or parameter "gian"; did you mean "gain"?'
    )
    assert parse_expression("gain + landing.error").unknown_name_problem(VALUES) == ""


@pytest.mark.parametrize(
    ("text", "holds"),
    [
        ("flown", True),
        ("not flown", False),
        ("gain > 2 and landing.error <= 0.5", True),
        ("0 < gain < 2 or waypoints.time[2] == 8", True),
        ("gain != 3 or not flown", False),
        ("flown or lost > 1", True),
    ],
)
def test_conditions(text, holds):
    assert parse_condition(text)(VALUES) == holds


@pytest.mark.parametrize(
    "text", ["lost > 1", "not lost > 1", "lost or flown", "1 / (gain - 3) > 0", "flown and lost"]
)
def test_a_condition_with_an_undefined_part_has_no_value(text):
    assert math.isnan(parse_condition(text)(VALUES))


@pytest.mark.parametrize(
    "text", ["gain in landing", "gain is gain", "gain if flown else 1", "x := 1", "gain > 'a'"]
)
def test_other_conditions_are_refused(text):
    with pytest.raises(ValueError, match="is not"):
        parse_condition(text)


def test_the_alternatives_of_a_condition_are_the_operands_of_its_outermost_or():
    condition = parse_condition("flown or gain > 4 or (lost and flown)")
    assert [part.text for part in condition.alternatives] == ["flown", "gain > 4", "lost and flown"]
    assert [part.text for part in parse_condition("gain > 4").alternatives] == ["gain > 4"]


def test_elements_of_arrays_are_names():
    assert parse_condition("plant.a[1,2] > plant.b[3]").names == ["plant.a[1,2]", "plant.b[3]"]
