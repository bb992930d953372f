"""Exact time: communication points are integers on a grid, seconds are made from them with one rounding."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import lcm


def exact(value: float | int | str | Fraction) -> Fraction:
    """The number a person wrote: 0.01 is 1/100, "1/60" is a sixtieth.

    Raises ValueError for what is no finite number.
    """
    return Fraction(repr(value)) if isinstance(value, float) else Fraction(value)


@dataclass(frozen=True, slots=True)
class Grid:
    """Communication points start + n * step, n = 0 ... count (seconds, as exact fractions)."""

    start: Fraction
    step: Fraction
    count: int
    _denominator: int
    _origin: int
    _stride: int

    @classmethod
    def of(cls, start: Fraction, stop: Fraction, step: Fraction) -> Grid:
        """The grid from start to stop. Raises ValueError unless step > 0 divides stop - start > 0."""
        if step <= 0:
            raise ValueError(f"the step size must be positive, found {float(step)!r}")
        if stop < start:
            raise ValueError(f"the stop time {float(stop)!r} lies before the start time {float(start)!r}")
        count = (stop - start) / step
        if count.denominator != 1:
            raise ValueError(f"{float(stop - start)!r} s is no multiple of the step size {float(step)!r} s")
        denominator = lcm(start.denominator, step.denominator)
        return cls(start, step, int(count), denominator, int(start * denominator), int(step * denominator))

    def seconds(self, n: int) -> float:
        """Time of communication point n: correctly rounded, whatever n is."""
        return (self._origin + n * self._stride) / self._denominator

    def index(self, time: Fraction) -> int:
        """The n whose time is exactly `time`; beyond `count` after the end. Raises ValueError off the grid and before it."""
        n = (time - self.start) / self.step
        if n.denominator != 1:
            raise ValueError(f"{float(time)!r} s lies between two communication points ({float(self.step)!r} s apart)")
        if n < 0:
            raise ValueError(f"{float(time)!r} s lies before the start time {self.seconds(0)!r} s")
        return int(n)
