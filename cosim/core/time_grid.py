"""Exact time: communication points are integers on a grid, seconds are made from them with one rounding."""

from __future__ import annotations

import re
from dataclasses import dataclass
from fractions import Fraction
from math import lcm

import numpy as np

#: integers up to this one are exact as floats
_MAX_EXACT_INTEGER = 2**53

#: a number of seconds in text, or a fraction of two; few digits, because Fraction would write 1e999999999 in full
_SECONDS_PATTERN = re.compile(r"[-+]?(\d{1,400}/\d{1,400}|(\d{1,400}\.?\d{0,400}|\.\d{1,400})([eE][-+]?\d{1,3})?)", re.ASCII)


def exact_fraction(value: float | int | str | Fraction) -> Fraction:
    """The number a person wrote: 0.01 is 1/100, "1/60" is a sixtieth.

    Raises ValueError for what is no finite number or no time in seconds that anybody could mean, ZeroDivisionError for "1/0".
    """
    if isinstance(value, str) and not _SECONDS_PATTERN.fullmatch(value.strip()):
        raise ValueError(f'expected a number or a fraction, found "{value:.40}"')
    number = Fraction(repr(value)) if isinstance(value, float) else Fraction(value)
    if abs(number) > _MAX_EXACT_INTEGER:
        raise ValueError(f"expected at most {_MAX_EXACT_INTEGER}")
    return number


@dataclass(frozen=True, slots=True)
class TimeGrid:
    """Communication points start + n * step, n = 0 ... count (seconds, as exact fractions)."""

    start: Fraction
    step: Fraction
    count: int
    _denominator: int
    _origin: int
    _stride: int

    @classmethod
    def from_times(cls, start: Fraction, stop: Fraction, step: Fraction) -> TimeGrid:
        """The grid from start to stop. Raises ValueError unless step > 0 divides stop - start > 0."""
        if step <= 0:
            raise ValueError(f"the step size must be positive, found {float(step)!r}")
        if stop < start:
            raise ValueError(f"the stop time {float(stop)!r} lies before the start time {float(start)!r}")
        count = (stop - start) / step
        if count > _MAX_EXACT_INTEGER:
            raise ValueError(f"{float(stop - start)!r} s are more than {_MAX_EXACT_INTEGER} steps of {float(step)!r} s")
        if count.denominator != 1:
            raise ValueError(f"{float(stop - start)!r} s is no multiple of the step size {float(step)!r} s")
        denominator = lcm(start.denominator, step.denominator)
        return cls(start, step, int(count), denominator, int(start * denominator), int(step * denominator))

    def time_at(self, n: int) -> float:
        """Time of communication point n: correctly rounded, whatever n is."""
        return (self._origin + n * self._stride) / self._denominator

    @property
    def integer_coefficients(self) -> dict[str, int]:
        """The grid in whole numbers: n is at (origin + n * stride) / denominator s."""
        return {"origin": self._origin, "stride": self._stride, "denominator": self._denominator}

    def times(self, points: range) -> np.ndarray:
        """Times of many communication points, shape (points,): the same numbers that `seconds` gives."""
        if not self.float_coefficients(points.stop):
            return np.array([self.time_at(n) for n in points], np.float64)
        n = np.arange(points.start, points.stop, points.step, dtype=np.int64)
        return (self._origin + n * self._stride) / self._denominator

    def float_coefficients(self, last: int) -> tuple[float, float, float] | None:
        """(origin, stride, denominator): n is at (origin + n * stride) / denominator, exact in floats but for the division.

        None when that does not hold for all points until `last`.
        """
        largest = max(abs(self._origin), abs(self._origin + last * self._stride), last * self._stride, self._denominator)
        return (self._origin, self._stride, self._denominator) if largest <= _MAX_EXACT_INTEGER else None

    def index(self, time: Fraction) -> int:
        """The n whose time is exactly `time`; beyond `count` after the end. Raises ValueError off the grid and before it."""
        n = (time - self.start) / self.step
        if n.denominator != 1:
            raise ValueError(f"{float(time)!r} s lies between two communication points ({float(self.step)!r} s apart)")
        if n < 0:
            raise ValueError(f"{float(time)!r} s lies before the start time {self.time_at(0)!r} s")
        return int(n)
