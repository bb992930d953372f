"""Success rates and statistics of many runs."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from cosim.studies.design import Point
from cosim.studies.execution.job import Record
from cosim.studies.summary.statistics import RunGroup, failure_causes, group_rows, wilson_interval
from cosim.studies.sweep import SweepRow


@pytest.mark.parametrize(("successes", "count"), [(0, 10), (1, 10), (7, 9), (50, 1000), (10, 10)])
def test_wilson_intervals_agree_with_scipy(successes, count):
    expected = stats.binomtest(successes, count).proportion_ci(0.95, method="wilson")
    assert wilson_interval(successes, count) == pytest.approx(
        (expected.low, expected.high), abs=1e-12
    )


def test_the_interval_without_runs_is_zero_to_one():
    assert wilson_interval(0, 0) == (0.0, 1.0)


def row(run, value, label="a", failure=""):
    return SweepRow(
        run,
        Point({"f": label}, {}),
        Record(str(run), {} if failure else {"k": value}, failure),
        not failure and value < 5,
    )


def test_statistics_use_only_finite_values():
    values = [3.0, 9.0, float("nan"), 4.0, float("inf"), 1.0]
    (group,) = group_rows(lambda: [row(run, value) for run, value in enumerate(values)], [])
    ((name, found),) = group.statistics()
    finite = np.array([3.0, 9.0, 4.0, 1.0])
    expected = {
        "count": 4,
        "mean": 4.25,
        "std": finite.std(ddof=1),
        "min": 1,
        "median": 3.5,
        "max": 9,
    }
    assert name == "k"
    assert {key: found[key] for key in expected} == pytest.approx(expected)
    assert found["q05"] == pytest.approx(np.quantile(finite, 0.05))


def test_groups_are_in_order_of_appearance_and_count_failures():
    found = group_rows(
        lambda: [row(0, 1.0, "b"), row(1, 9.0, "a"), row(2, 0.0, "b", "broken")], ["f"]
    )
    assert [(g.labels["f"], g.runs, g.failed, g.passed, g.success_rate) for g in found] == [
        ("b", 2, 1, 1, 0.5),
        ("a", 1, 0, 0, 0.0),
    ]


def test_a_shared_run_counts_once_in_intervals():
    """Two groups of eight points share two runs, one of which is a success."""
    rows = [
        replace(
            row(run, 9 * (run % 2), "ab"[run // 8]), record=Record(str(run % 2), {}), shared=True
        )
        for run in range(16)
    ]
    for group in group_rows(lambda: rows, ["f"]):
        assert (group.runs, group.distinct, group.success_rate, group.interval) == (
            8,
            2,
            0.5,
            wilson_interval(1, 2),
        )


def test_the_standard_deviation_of_one_value_is_nan():
    group = RunGroup({})
    group.add(row(0, 2.0))
    ((_, found),) = group.statistics()
    assert np.isnan(found["std"])
    assert dict(group.shown_statistics())["k"]["std"] == "-"


def test_of_a_boolean_the_share_of_true_values_is_shown():
    (group,) = group_rows(lambda: [row(run, run > 0) for run in range(15)], [])
    (shown,) = (numbers for _, numbers in group.shown_statistics())
    assert {key: text for key, text in shown.items() if text} == {"count": "15", "mean": "93.3 %"}


def test_the_most_frequent_cause_comes_first():
    rows = [row(0, 0, failure="x"), row(1, 0, failure="y"), row(2, 1.0), row(3, 0, failure="y")]
    assert failure_causes(rows) == [("y", 2, 1), ("x", 1, 0)]
