"""Constraints of KPIs."""

import math

import pytest

from cosim.studies.optimization import parse_constraint

VALUES = {"landing.error": 0.5, "gain": 3.0, "lost": math.nan}


@pytest.mark.parametrize(
    ("text", "violation"),
    [
        ("gain <= 3", 0.0),
        ("gain <= 2.5", 0.5),
        ("gain >= 5 * landing.error", 0.0),
        ("gain + 1 >= 6", 2.0),
    ],
)
def test_the_violation_of_a_constraint_is_its_excess(text, violation):
    assert parse_constraint(text).violation(VALUES) == violation


@pytest.mark.parametrize("text", ["log(0) <= 1", "min(1, lost) <= 1"])
def test_the_violation_is_infinite_when_a_side_is_nan(text):
    assert parse_constraint(text).violation(VALUES) == math.inf


@pytest.mark.parametrize("text", ["gain", "gain < 3", "1 <= gain <= 2", "gain == 3"])
def test_other_comparisons_are_refused(text):
    with pytest.raises(ValueError, match="expected a comparison with <= or >="):
        parse_constraint(text)
