from fractions import Fraction

import numpy as np
import pytest

from cosim.core.time_grid import TimeGrid, exact_divisor, exact_fraction


def grid(stop, step, start=0):
    return TimeGrid.from_times(exact_fraction(start), exact_fraction(stop), exact_fraction(step))


def test_numbers_are_read_as_a_person_wrote_them():
    assert exact_fraction(0.01) == Fraction(1, 100)
    assert exact_fraction("1/60") == Fraction(1, 60)
    assert exact_fraction(1e-9) == Fraction(1, 10**9)


def test_communication_points_accumulate_no_rounding_errors():
    points = grid(120, 0.01)
    assert points.count == 12_000
    assert points.time_at(12_000) == 120.0
    assert all(points.time_at(n) == n / 100 for n in range(12_001))


def test_ten_million_steps_are_exact_to_the_last_bit():
    points = grid(10**5, 0.01)
    assert points.time_at(10**7) == 1e5
    assert points.time_at(9_999_999) == float(Fraction(9_999_999, 100))


def test_times_of_a_60_hz_grid_are_rounded_once():
    points = grid(10, "1/60")
    for n in (1, 7, 59, 600):
        assert points.time_at(n) == float(Fraction(n, 60))
    assert not np.array_equal(
        [n * (1 / 60) for n in range(601)], [points.time_at(n) for n in range(601)]
    )


def test_the_grid_ends_at_the_last_whole_step():
    assert (grid(0.027, 0.01).count, grid(0.027, 0.01).end) == (2, Fraction(2, 100))
    with pytest.raises(
        ValueError, match=r"the duration 0\.027 s is shorter than the step size 0\.1 s"
    ):
        grid(0.027, 0.1)


def test_a_rounded_step_size_stands_for_the_exact_divisor():
    assert exact_divisor(Fraction(10), exact_fraction("0.0333333333333333")) == Fraction(1, 30)
    assert exact_divisor(Fraction(10), exact_fraction("0.0333333")) == exact_fraction("0.0333333")
    assert exact_divisor(Fraction(1), Fraction(1, 100)) == Fraction(1, 100)


def test_a_step_of_zero_is_refused():
    with pytest.raises(ValueError, match="must be positive"):
        grid(1, 0)


def test_a_time_between_communication_points_is_refused():
    points = grid(1, 0.01)
    assert points.index(exact_fraction(0.29)) == 29
    with pytest.raises(ValueError, match="lies between two communication points"):
        points.index(exact_fraction(0.295))
    with pytest.raises(ValueError, match=r"lies before the start time 0\.0 s"):
        points.index(exact_fraction(-1))
