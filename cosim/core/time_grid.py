"""The time base of a run: exact communication points and their times in seconds.

A communication point is an integer on a grid of exact fractions. Its time is rounded once: here, or
in the native executor by the same formula (`TimeGrid.coefficients`). Every recorded row has its
time as float64, so that readers of rows need no grid. A row may also lie between two communication
points, and several rows may have the same time (the limits before and after an event).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from fractions import Fraction
from math import lcm

import numpy as np

#: largest magnitude of a time (s); all integers up to this one are exact as float64
MAX_TIME = 2**53
#: number of times that NumPy computes faster than Python
MIN_VECTOR_LENGTH = 16

#: a decimal number or a fraction; the number of digits is limited because Fraction expands
#: 1e999999999
_SECONDS_PATTERN = re.compile(
    r"[-+]?(\d{1,400}/\d{1,400}|(\d{1,400}\.?\d{0,400}|\.\d{1,400})([eE][-+]?\d{1,3})?)", re.ASCII
)


def exact_fraction(value: float | int | str | Fraction) -> Fraction:
    """Return a number exactly as written: 0.01 becomes 1/100, "1/60" one sixtieth.

    Args:
        value: A number, or a text with a decimal number or a fraction.

    Raises:
        ValueError: The value is no finite number, or its magnitude exceeds 2**53.
        ZeroDivisionError: The denominator is zero.
    """
    if isinstance(value, str) and not _SECONDS_PATTERN.fullmatch(value.strip()):
        raise ValueError(f'expected a number or a fraction, found "{value:.40}"')
    number = Fraction(repr(value)) if isinstance(value, float) else Fraction(value)
    if abs(number) > MAX_TIME:
        raise ValueError(f"expected at most {MAX_TIME}")
    return number


def fraction_text(value: Fraction) -> str:
    """Return a time as a scenario file has it: a fraction as text, "2/1" for 2."""
    return f"{value.numerator}/{value.denominator}"


def time_text(value: Fraction) -> str:
    """Return a time with its unit as a message has it, a fraction in quotes if no number is exact.

    >>> time_text(Fraction(1, 100)), time_text(Fraction(1, 60))
    ('0.01 s', '"1/60" s')
    """
    number = repr(float(value))
    return f"{number} s" if exact_fraction(number) == value else f'"{fraction_text(value)}" s'


def exact_divisor(duration: Fraction, step: Fraction) -> Fraction:
    """Return the exact divisor of a duration that a rounded decimal number stands for.

    1/30 s of 10 s for 0.0333333333333333 s.

    Args:
        duration: Duration (s).
        step: Step size (s).

    Returns:
        `step` itself if it differs from every divisor by more than 1e-12.
    """
    count = round(duration / step) if step > 0 else 0
    divisor = duration / count if count else step
    return divisor if abs(divisor - step) <= step * Fraction(1, 10**12) else step


@dataclass(frozen=True, slots=True)
class TimeGrid:
    """Communication points start + n * step, n = 0 ... count (seconds, as exact fractions).

    The last step may be shorter.
    """

    start: Fraction
    step: Fraction
    count: int
    _denominator: int
    _origin: int
    _stride: int
    #: time of the last point (s) if the last step is shorter
    _stop: Fraction | None = None

    @classmethod
    def from_times(cls, start: Fraction, stop: Fraction, step: Fraction) -> TimeGrid:
        """Return the grid from `start` to the last whole step at or before `stop`.

        Args:
            start: Start time (s).
            stop: Stop time (s).
            step: Step size (s).

        Raises:
            ValueError: `stop` is less than `start`, `step` is not positive, or no whole step fits
                between `start` and `stop`.
        """
        if step <= 0:
            raise ValueError(f"the step size must be positive, found {float(step)!r}")
        if stop < start:
            raise ValueError(
                f"the stop time {float(stop)!r} lies before the start time {float(start)!r}"
            )
        count = (stop - start) / step
        if count > MAX_TIME:
            raise ValueError(
                f"{float(stop - start)!r} s are more than {MAX_TIME} steps of {float(step)!r} s"
            )
        if 0 < count < 1:
            raise ValueError(
                f"the duration {float(stop - start)!r} s is shorter than the step size "
                f"{float(step)!r} s"
            )
        denominator = lcm(start.denominator, step.denominator)
        return cls(
            start, step, int(count), denominator, int(start * denominator), int(step * denominator)
        )

    def ending_at(self, stop: Fraction) -> TimeGrid:
        """Return the grid that ends exactly at `stop` (s).

        The last step is shorter if `stop` lies between two communication points.
        """
        count = (stop - self.start) / self.step
        if count.denominator == 1:
            return replace(self, count=int(count), _stop=None)
        return replace(self, count=int(count) + 1, _stop=stop)

    def time_at(self, n: int) -> float:
        """Return the time of communication point n (s), correctly rounded."""
        if self._stop is not None and n >= self.count:
            return float(self._stop)
        return (self._origin + n * self._stride) / self._denominator

    def times(self, first: int, end: int) -> np.ndarray:
        """Return the times of communication points `first` to `end` - 1 (s), like `time_at`.

        The division is the only rounding, as long as float64 represents the numerators exactly.
        Otherwise Python's integers are divided, which it does with one rounding.
        """
        if end - first < MIN_VECTOR_LENGTH or not self.coefficients(end - 1):
            return np.array([self.time_at(n) for n in range(first, end)], np.float64)
        points = np.arange(first, end, dtype=np.float64)
        times: np.ndarray = (self._origin + points * self._stride) / self._denominator
        return times

    def coefficients(self, last: int) -> tuple[float, float, float] | None:
        """Return origin, stride, denominator of the times (origin + n * stride) / denominator.

        Args:
            last: The last communication point for which the formula is needed.

        Returns:
            None if the last step is shorter, or float64 rounds more than the quotient up to `last`.
        """
        if self._stop is not None and last >= self.count:
            return None
        origin, reach = self._origin, last * self._stride
        largest = max(abs(origin), abs(origin + reach), reach, self._denominator)
        return (origin, self._stride, self._denominator) if largest <= MAX_TIME else None

    @property
    def end(self) -> Fraction:
        """Time of the last communication point (s)."""
        return self.start + self.count * self.step if self._stop is None else self._stop

    @property
    def whole_steps(self) -> int:
        """Number of steps that are not shorter."""
        return self.count - (self._stop is not None)

    def index(self, time: Fraction) -> int:
        """Return the communication point at exactly `time` (s); it exceeds `count` after the end.

        Args:
            time: Time (s).

        Raises:
            ValueError: The time lies between two communication points or before the start.
        """
        if time == self._stop:
            return self.count
        n = (time - self.start) / self.step
        if n.denominator != 1:
            raise ValueError(
                f"{float(time)!r} s lies between two communication points ({float(self.step)!r} s "
                "apart)"
            )
        if n < 0:
            raise ValueError(f"{float(time)!r} s lies before the start time {self.time_at(0)!r} s")
        return int(n)
