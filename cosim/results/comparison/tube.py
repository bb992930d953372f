"""The tube around a reference, and the points at which a result has to be inside.

The reference is the polyline through its rows. The tube is what a rectangle covers whose centre travels along it: `time` wide to
both sides, and the larger of `absolute` and `relative` times the range (maximum - minimum) of the reference up and down. Hence

    lower(t) = min r(s) - half_width, upper(t) = max r(s) + half_width over all s of the reference with |s - t| <= time.

Two rows with one time are a jump: its whole height belongs to the reference. This is the tube of funnel and pyfunnel (Lawrence
Berkeley National Laboratory) without their tolerance relative to the local value.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

#: times that differ by less than this, relative to the largest of them, are the same: sums of decimal fractions are not exact
RELATIVE_TIME_TOLERANCE = 1e-14

#: by this share of the distance between rows they may be off, and still be evenly spaced
_SPACING_TOLERANCE = 1e-9


class Tolerance(NamedTuple):
    """How far a result may be off: `absolute` in the signal's unit, `relative` to the reference's range (1), `time` in s."""

    absolute: float = 0.0
    relative: float = 0.0
    time: float = 0.0

    def half_width(self, reference: np.ndarray) -> float:
        """Half the height of the tube around `reference`, in the signal's unit."""
        return max(self.absolute, self.relative * float(np.ptp(reference)))

    def scaled(self, factor: float) -> Tolerance:
        """All three multiplied by `factor`."""
        return Tolerance(*(factor * part for part in self))


class Tube(NamedTuple):
    """What is allowed at each of `time` (s): lower <= value <= upper; all of shape (points,)."""

    time: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class TimeWindows:
    """The pieces [t - reach, t + reach] of a reference around each of `times`, reach in s; beyond its ends there is nothing."""

    def __init__(self, reference_time: np.ndarray, times: np.ndarray, reach: float):
        reach += time_tolerance(reference_time)
        begins, ends = times - reach, times + reach
        first = np.searchsorted(reference_time, begins, "left")
        last = np.searchsorted(reference_time, ends, "right") - 1
        self._edges = [_Interpolation(reference_time, moments) for moments in (begins, ends)]
        self._levels = list(_doubling_levels(first, last))

    def extremes(self, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest value of the reference in each window, each of shape (times,)."""
        begins, ends = (places.values(reference) for places in self._edges)
        return tuple(self._extend_extremes(choose, choose(begins, ends), reference) for choose in (np.minimum, np.maximum))  # type: ignore

    def _extend_extremes(self, choose: np.ufunc, found: np.ndarray, row: np.ndarray) -> np.ndarray:
        """Over all rows inside: after k rounds `row[i]` is the extreme of the 2**k rows from i on; two of those make a window."""
        for k, (windows, left, right) in enumerate(self._levels):
            if k:
                row = choose(row[: -(2 ** (k - 1))], row[2 ** (k - 1) :])
            if windows.size:
                found[windows] = choose(found[windows], choose(row[left], row[right]))
        return found


def _doubling_levels(first: np.ndarray, last: np.ndarray) -> Iterable[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """For each k: the windows of 2**k ... 2**(k+1) - 1 rows, and where their first and their last 2**k rows begin."""
    exponents = np.frexp(np.maximum(last - first + 1, 0))[1] - 1
    for k in range(int(exponents.max(initial=-1)) + 1):
        windows = np.flatnonzero(exponents == k)
        yield windows, first[windows], last[windows] - 2**k + 1


class _Interpolation:
    """Moments between the rows of a reference, held to its span."""

    def __init__(self, time: np.ndarray, moments: np.ndarray):
        moments = np.clip(moments, time[0], time[-1])
        self._left = np.clip(np.searchsorted(time, moments, "right") - 1, 0, max(len(time) - 2, 0))
        self._right = np.minimum(self._left + 1, len(time) - 1)
        length = time[self._right] - time[self._left]
        self._share = np.divide(moments - time[self._left], length, out=np.zeros(len(moments)), where=length > 0)

    def values(self, reference: np.ndarray) -> np.ndarray:
        left, right = reference[self._left], reference[self._right]
        return left + self._share * (right - left)


class UniformTimeWindows:
    """As `Windows`, around every row of a reference whose rows are `spacing` (s) apart: about nine times faster."""

    def __init__(self, spacing: float, reach: float):
        rows = reach / spacing
        self._count = round(rows) if abs(rows - round(rows)) < _SPACING_TOLERANCE else int(rows)
        self._share = max(rows - self._count, 0.0)

    def extremes(self, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest value of the reference in each window, each of shape (rows,)."""
        count, rows = self._count, len(reference)
        padded = np.pad(reference, count + 1, mode="edge")
        begins = self._interpolate_edges(padded[1:], padded, rows)
        ends = self._interpolate_edges(padded[2 * count + 1 :], padded[2 * count + 2 :], rows)
        lower, upper = (_sliding_extreme(choose, padded[1:-1], 2 * count + 1) for choose in (np.minimum, np.maximum))
        return np.minimum(lower, np.minimum(begins, ends)), np.maximum(upper, np.maximum(begins, ends))

    def _interpolate_edges(self, last: np.ndarray, beyond: np.ndarray, rows: int) -> np.ndarray:
        """The edges of all windows, between the last row inside and the one beyond it."""
        return last[:rows] + self._share * (beyond[:rows] - last[:rows])


def _sliding_extreme(choose: np.ufunc, row: np.ndarray, width: int) -> np.ndarray:
    """The extreme of each `width` neighbours, by doubling."""
    length, rows = 1, len(row) - width + 1
    while 2 * length <= width:
        row = choose(row[:-length], row[length:])
        length *= 2
    return choose(row[:rows], row[width - length :][:rows])


def uniform_spacing(time: np.ndarray) -> float:
    """The distance between rows (s) where it is the same everywhere, else 0."""
    if len(time) < 2:
        return 0.0
    spacing = float(time[-1] - time[0]) / (len(time) - 1)
    even = time[0] + spacing * np.arange(len(time))
    return spacing if spacing > 0 and np.abs(even - time).max() < _SPACING_TOLERANCE * spacing else 0.0


def time_tolerance(time: np.ndarray) -> float:
    """By how much two times of `time` may differ and yet be the same, in s."""
    return RELATIVE_TIME_TOLERANCE * float(np.abs(time[[0, -1]]).max())


class ComparisonPoints:
    """Where a result is held against a reference: at its own rows within the span of the reference, and, interpolated linearly,
    at the reference's times between them, so that a coarse result misses nothing.
    """

    def __init__(self, result_time: np.ndarray, reference_time: np.ndarray):
        margin = time_tolerance(reference_time)
        self._result_time = result_time
        self._rows = slice(
            int(np.searchsorted(result_time, reference_time[0] - margin, "left")),
            int(np.searchsorted(result_time, reference_time[-1] + margin, "right")),
        )
        self._reference_times = np.setdiff1d(reference_time, result_time)
        times = np.concatenate([result_time[self._rows], self._reference_times])
        self._order = np.argsort(times, kind="stable") if self._reference_times.size else slice(None)
        self.time = times[self._order]
        self._reference_time = reference_time

    def interpolate_reference(self, reference: np.ndarray) -> np.ndarray:
        """A signal of the reference at all points, interpolated linearly, shape (points,)."""
        if np.array_equal(self.time, self._reference_time):
            return reference
        return np.interp(self.time, self._reference_time, reference)

    def interpolate_result(self, result: np.ndarray) -> np.ndarray:
        """A signal of the result at all points, shape (points,)."""
        own = result[self._rows]
        if not self._reference_times.size:
            return own
        return np.concatenate([own, np.interp(self._reference_times, self._result_time, result)])[self._order]
