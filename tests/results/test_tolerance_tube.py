"""Tube compared with a brute-force search, hand-made cases and pyfunnel."""

import csv

import numpy as np
import pytest

from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.comparison import Comparer, compare
from cosim.results.tolerance_tube import Tolerance


def recorded(time, **columns):
    columns = {name: np.asarray(values) for name, values in columns.items()}
    return Result(Recording(np.asarray(time, dtype=float), columns, dict.fromkeys(columns, "")))


def bounds(moments, time, values, *tolerance):
    """Return lower and upper bound at the rows of a result with these times."""
    comparer = Comparer(recorded(moments, x=moments), recorded(time, x=values))
    rows = np.flatnonzero(np.isin(comparer.points.time, moments))
    assert list(comparer.points.time[rows]) == list(moments)
    return comparer.tube("x", Tolerance(*tolerance), rows)[1:]


def searched(moments, time, values, reach):
    """Return the extremes of a polyline within `reach` of each moment, from all corners and both
    ends of each window.
    """
    lower, upper = [], []
    for moment in moments:
        begin, end = max(moment - reach, time[0]), min(moment + reach, time[-1])
        inside = [value for at, value in zip(time, values, strict=True) if begin <= at <= end]
        inside += [np.interp(begin, time, values), np.interp(end, time, values)]
        lower.append(min(inside))
        upper.append(max(inside))
    return np.array(lower), np.array(upper)


def test_time_tolerance_permits_early_and_late_steps():
    lower, upper = bounds([0, 0.5, 0.9, 1.5, 2.1, 2.5, 3], [0, 1, 2, 3], [0, 0, 1, 1], 0, 0, 0.5)
    assert upper == pytest.approx([0, 0, 0.4, 1, 1, 1, 1])
    assert lower == pytest.approx([0, 0, 0, 0, 0.6, 1, 1])


def test_two_rows_with_one_time_are_a_jump():
    lower, upper = bounds([0, 0.8, 1, 1.2, 2], [0, 1, 1, 2], [0.0, 0, 5, 5], 0.5, 0, 0.25)
    assert list(upper) == [0.5, 5.5, 5.5, 5.5, 5.5]
    assert list(lower) == [-0.5, -0.5, -0.5, -0.5, 4.5]


def test_without_a_tolerance_in_time_a_jump_is_a_point():
    lower, upper = bounds([0, 0.999, 1, 1.001, 2], [0, 1, 1, 2], [0.0, 0, 5, 5])
    assert list(lower) == [0, 0, 0, 5, 5]
    assert list(upper) == [0, 0, 5, 5, 5]


def test_the_larger_of_absolute_and_relative_counts():
    assert bounds([0], [0, 1, 2], [7.0, 1.0, 11.0], 0.5, 0.02, 0)[1] == pytest.approx([7.5])
    assert bounds([0], [0, 1, 2], [7.0, 1.0, 11.0], 0.5, 0.2, 0)[1] == pytest.approx([9.0])


def test_rounding_of_decimal_fractions_is_tolerated():
    """The reference jumps at 0.03, and 0.05 - 0.02 is slightly more than 0.03 in float64."""
    time = np.array([0, 0.03, 0.03, 0.06])
    assert list(bounds([0.05], time, [0.0, 0, 5, 5], 0, 0, 0.02)[0]) == [0.0]


@pytest.mark.parametrize("seed", range(20))
def test_windows_match_a_brute_force_search(seed):
    rng = np.random.default_rng(seed)
    time = np.sort(rng.integers(0, 60, rng.integers(1, 80)) / 8)  # some times twice
    values = rng.normal(size=len(time))
    moments = np.sort(rng.uniform(time[0], time[-1], 50))
    reach = rng.choice([0, 0.125, 0.3, 2.5, 99])
    lower, upper = searched(moments, time, values, reach)
    found = bounds(moments, time, values, 0, 0, reach)
    assert found[0] == pytest.approx(lower, abs=1e-9)
    assert found[1] == pytest.approx(upper, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_tubes_around_evenly_spaced_rows(seed):
    rng = np.random.default_rng(seed)
    time = rng.uniform(-5, 5) + np.arange(rng.integers(2, 90)) * 0.01
    values = rng.normal(size=len(time))
    reach = rng.choice([0, 0.01, 0.015, 0.03, 0.1234, 5])
    lower, upper = searched(time, time, values, reach)
    comparer = Comparer(recorded(time, x=values), recorded(time, x=values))
    tube = comparer.tube("x", Tolerance(0, 0, reach))
    assert tube.lower == pytest.approx(lower, abs=1e-9)
    assert tube.upper == pytest.approx(upper, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_a_result_passes_where_every_point_is_inside(seed):
    """The shortcut for values near the reference does not change the verdict."""
    rng = np.random.default_rng(seed)
    time = np.arange(200) / 10
    values = np.cumsum(rng.normal(size=200))
    found = np.interp(time - 0.08, time, values) + rng.uniform(-0.1, 0.1, 200)
    lower, upper = searched(time, time, values, 0.1)
    allowed = rng.choice([0.05, 0.1, 0.2])
    outside = np.flatnonzero((found < lower - allowed) | (found > upper + allowed))
    verdict = compare(
        recorded(time, x=found), recorded(time, x=values), {"x": Tolerance(allowed, 0, 0.1)}
    ).verdicts[0]
    assert verdict.time == (time[outside[0]] if outside.size else np.inf)
    assert f"{outside.size} of 200 points" in verdict.problem or not outside.size


@pytest.mark.parametrize("seed", range(8))
def test_pyfunnel_draws_the_same_tube(seed, tmp_path):
    pyfunnel = pytest.importorskip("pyfunnel")
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.05, 0.2, 120))
    reference = np.cumsum(rng.normal(size=120))
    moments = np.sort(np.concatenate([time, rng.uniform(time[0], time[-1], 200)]))
    values = np.interp(moments, time, reference) + rng.normal(size=320)
    allowed, reach = rng.uniform(0.1, 1), rng.uniform(0.02, 0.5)
    pyfunnel.compareAndReport(
        time, reference, moments, values, outputDirectory=str(tmp_path), atolx=reach, atoly=allowed
    )
    with (tmp_path / "errors.csv").open() as file:
        times, errors = np.array(list(csv.reader(file))[1:], np.float64).T
    tube = Comparer(recorded(moments, x=values), recorded(time, x=reference)).tube(
        "x", Tolerance(allowed, 0, reach)
    )
    distance = np.maximum(np.maximum(tube.lower - values, values - tube.upper), 0)
    assert times == pytest.approx(moments)
    assert (errors > 1e-9).sum() > 10
    assert np.abs(errors) == pytest.approx(distance, abs=1e-5)
