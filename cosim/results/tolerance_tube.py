"""Tube around a reference, and the points at which a result is compared with it.

The reference is the polyline through its rows. The tube is the area covered by a rectangle whose
centre moves along the polyline. Its half length is `time`; its half height is the larger of
`absolute` and `relative` times the range (maximum - minimum) of the reference. Hence

    lower(t) = min r(s) - half_width
    upper(t) = max r(s) + half_width,  both over all s of the reference with |s - t| <= time.

Two rows with the same time are a jump, and the reference then includes all values between the two
rows. This is the tube of funnel and pyfunnel (Lawrence Berkeley National Laboratory) without their
tolerance relative to the local value.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

#: relative difference up to which times are equal, because sums of decimal fractions are not exact
RELATIVE_TIME_TOLERANCE = 1e-14


class Tolerance(NamedTuple):
    """Permitted deviation from a reference.

    Attributes:
        absolute: In the unit of the signal.
        relative: Relative to the range (maximum - minimum) of the reference (1).
        time: In s.
    """

    absolute: float = 0.0
    relative: float = 0.0
    time: float = 0.0

    def half_width(self, reference: np.ndarray) -> float:
        """Return half the height of the tube around `reference`, in the unit of the signal."""
        return max(self.absolute, self.relative * float(np.ptp(reference)))

    def scaled(self, factor: float) -> Tolerance:
        """Return the tolerance with all members multiplied by `factor`."""
        return Tolerance(*(factor * part for part in self))


class Tube(NamedTuple):
    """Permitted values at each `time` (s): lower <= value <= upper; all of shape (points,)."""

    time: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


class TimeWindows:
    """Windows [t - reach, t + reach] around each of `times` (s), clipped to the reference's span.

    The extremes of the reference in a window are those of the rows inside and of the interpolated
    values at its two edges, because the reference is a polyline.
    """

    def __init__(self, reference_time: np.ndarray, times: np.ndarray, reach: float):
        reach += time_tolerance(reference_time)
        begins, ends = times - reach, times + reach
        first = np.searchsorted(reference_time, begins, "left")
        last = np.searchsorted(reference_time, ends, "right") - 1
        self._edges = [_Interpolation(reference_time, moments) for moments in (begins, ends)]
        self._levels = list(_doubling_levels(first, last))

    def extremes(self, reference: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the smallest and the largest value in each window, each of shape (times,)."""
        begins, ends = (edge.values(reference) for edge in self._edges)
        lower = self._include_rows(np.minimum, np.minimum(begins, ends), reference)
        return lower, self._include_rows(np.maximum, np.maximum(begins, ends), reference)

    def _include_rows(self, choose: np.ufunc, extremes: np.ndarray, row: np.ndarray) -> np.ndarray:
        """Extend the extremes of the edges by all rows inside the windows.

        The windows are processed in rounds by their number of rows. In round k, `row[i]` is the
        extreme of the 2**k rows from i on. Two such pieces, which may overlap, cover each window of
        the round.
        """
        for k, (windows, left, right) in enumerate(self._levels):
            if k:
                row = choose(row[: -(2 ** (k - 1))], row[2 ** (k - 1) :])
            if left.size:
                rows = choose(row.take(left), row.take(right))
                extremes[windows] = choose(extremes[windows], rows)
        return extremes


def _doubling_levels(
    first: np.ndarray, last: np.ndarray
) -> Iterator[tuple[np.ndarray | slice, np.ndarray, np.ndarray]]:
    """Yield for each k the windows of 2**k to 2**(k+1) - 1 rows.

    With the indices at which their first and their last 2**k rows begin.
    """
    exponents = np.frexp(np.maximum(last - first + 1, 0))[1] - 1
    for k in range(int(exponents.max(initial=-1)) + 1):
        windows = np.flatnonzero(exponents == k)
        all_or_some = slice(None) if windows.size == first.size else windows  # a slice is faster
        yield all_or_some, first[windows], last[windows] - 2**k + 1


class _Interpolation:
    """Linear interpolation of a reference at given moments (s), clipped to its span."""

    def __init__(self, time: np.ndarray, moments: np.ndarray):
        moments = np.clip(moments, time[0], time[-1])
        self._left = np.clip(np.searchsorted(time, moments, "right") - 1, 0, max(len(time) - 2, 0))
        self._right = np.minimum(self._left + 1, len(time) - 1)
        length = time[self._right] - time[self._left]
        self._fraction = np.divide(
            moments - time[self._left], length, out=np.zeros(len(moments)), where=length > 0
        )

    def values(self, reference: np.ndarray) -> np.ndarray:
        """Return the values at the moments, shape (moments,)."""
        left, right = reference.take(self._left), reference.take(self._right)
        return np.asarray(left + self._fraction * (right - left))


def time_tolerance(time: np.ndarray) -> float:
    """Return the difference (s) up to which two times of `time` are equal."""
    return RELATIVE_TIME_TOLERANCE * float(np.abs(time[[0, -1]]).max())


class ComparisonPoints:
    """Points at which a result is compared with a reference.

    These are the rows of the result within the span of the reference, and the times of the
    reference between them, at which the result is interpolated linearly.

    Attributes:
        time: Times of the points (s), shape (points,).
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
        self._order = (
            np.argsort(times, kind="stable") if self._reference_times.size else slice(None)
        )
        self.time = times[self._order]
        self._reference_time = reference_time

    def interpolate_reference(self, reference: np.ndarray) -> np.ndarray:
        """Return a signal of the reference at all points, shape (points,)."""
        if np.array_equal(self.time, self._reference_time):
            return reference
        return np.asarray(np.interp(self.time, self._reference_time, reference))

    def interpolate_result(self, result: np.ndarray) -> np.ndarray:
        """Return a signal of the result at all points, shape (points,)."""
        own = result[self._rows]
        if not self._reference_times.size:
            return own
        return np.concatenate([own, np.interp(self._reference_times, self._result_time, result)])[
            self._order
        ]
