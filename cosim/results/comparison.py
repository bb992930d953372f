"""Comparison of a result with its reference, signal by signal."""

from __future__ import annotations

import math
import re
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from typing import NamedTuple

import numpy as np

from ..core.errors import InputError, did_you_mean, pattern_hint
from ..core.text import count_noun
from . import Result
from .tolerance_tube import (
    ComparisonPoints,
    TimeWindows,
    Tolerance,
    Tube,
    time_tolerance,
)

#: share of all points up to which it is faster to compute the tube only at these points
DENSE_FRACTION = 0.1
#: resolution of `needed_share`
SHARE_STEPS = 16
#: a full turn in the units of angles
TURNS = {"rad": 2 * math.pi, "deg": 360.0}
#: largest range in turns of an angle that is kept within one turn; a little more than 1, because
#: references are rounded
MAX_WRAPPED_RANGE = 1.01


def compare(result: Result, reference: Result, tolerances: Mapping[str, Tolerance]) -> Comparison:
    """Compare the signals of a reference that match a pattern with those of a result.

    A signal fails if it leaves its tube (see `tube`), is missing, does not cover the time of the
    reference, or is NaN or infinite in either. Strings fail if they differ. A pattern that matches
    no signal fails as well. Angles (rad, deg) that are kept within one turn, such as -pi ... pi,
    differ by at most half a turn.

    Args:
        result: The result.
        reference: The reference.
        tolerances: Tolerance by pattern. "*" in a pattern matches any text, also dots. The last
            matching pattern counts.

    Raises:
        InputError: A tolerance is negative, NaN or infinite.
    """
    problems = []
    for pattern, tolerance in tolerances.items():
        for name, value in tolerance._asdict().items():
            if not 0 <= value < math.inf:
                expected = "expected a finite number of at least 0"
                problems.append(f'tolerance of "{pattern}": "{name}" is {value}, {expected}')
    if problems:
        raise InputError(problems)
    selected = match_tolerances(tolerances, list(reference))
    unmatched = [pattern for pattern in tolerances if not reference.signals(pattern)]
    verdicts = [
        Verdict(
            f'"{pattern}"', f"matches no signal of the reference{pattern_hint(pattern, reference)}"
        )
        for pattern in unmatched
    ]
    for role, run in (("the reference", reference), ("the result", result)):
        if not len(run.time):
            return Comparison((*verdicts, Verdict(role, "has no rows")))
    comparer = Comparer(result, reference)
    for name, tolerance in selected.items():
        verdicts.append(comparer.compare_signal(name, tolerance))
    return Comparison(tuple(verdicts))


def needed_share(result: Result, reference: Result, tolerances: Mapping[str, Tolerance]) -> float:
    """Return the share of all tolerances (1) with which a comparison that passes would still pass.

    Args:
        result: The result.
        reference: The reference.
        tolerances: Tolerance by pattern, see `compare`.

    Returns:
        A multiple of 1/SHARE_STEPS, found by bisection; 0 if the result equals the reference.
    """

    def passes(step: int) -> bool:
        share = step / SHARE_STEPS
        return compare(
            result,
            reference,
            {pattern: tolerance.scaled(share) for pattern, tolerance in tolerances.items()},
        ).passed

    return bisect_left(range(SHARE_STEPS), True, key=passes) / SHARE_STEPS


def match_tolerances(tolerances: Mapping[str, Tolerance], names: list[str]) -> dict[str, Tolerance]:
    """Return the tolerance of each name that matches a pattern, in the order of `names`.

    The last matching pattern counts.
    """
    patterns = [
        (re.compile(".*".join(map(re.escape, pattern.split("*")))), tolerance)
        for pattern, tolerance in tolerances.items()
    ]
    matching = {}
    for name in names:
        for pattern, tolerance in patterns:
            if pattern.fullmatch(name):
                matching[name] = tolerance
    return matching


class Comparer:
    """Comparison of the signals of two results that have rows.

    Everything that depends only on times is computed once.
    """

    def __init__(self, result: Result, reference: Result):
        self._result, self._reference = result, reference

    @cached_property
    def points(self) -> ComparisonPoints:
        """Points at which the result is compared."""
        return ComparisonPoints(self._result.time, self._reference.time)

    def series(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Return a signal of the result at all `points` and that of the reference at its rows.

        An angle that is kept within one turn is continued without jumps, and the reference is the
        nearest of its equal angles.
        """
        result, reference = _to_floats(self._result, name), _to_floats(self._reference, name)
        turn = TURNS.get(self._unit(name))
        if (
            turn
            and turn / 2 < np.ptp(np.concatenate([result, reference])) <= MAX_WRAPPED_RANGE * turn
        ):
            result = np.unwrap(result, period=turn)
            distance = np.interp(self._reference.time, self._result.time, result) - reference
            reference = reference + turn * np.round(distance / turn)
        return self.points.interpolate_result(result), reference

    def tube(self, name: str, tolerance: Tolerance, rows: slice | np.ndarray = slice(None)) -> Tube:
        """Return the tube around a signal of the reference at all `points`, or at some rows."""
        half_width = self._half_width(name, tolerance)
        return self._tube(self.series(name)[1], half_width, tolerance.time, rows)

    def _tube(
        self,
        reference: np.ndarray,
        half_width: float,
        reach: float,
        rows: slice | np.ndarray,
    ) -> Tube:
        time = self.points.time[rows]
        windows = (
            self._windows(reach)
            if isinstance(rows, slice)
            else TimeWindows(self._reference.time, time, reach)
        )
        lower, upper = windows.extremes(reference)
        return Tube(time, lower - half_width, upper + half_width)

    @cached_property
    def _windows(self) -> Callable[[float], TimeWindows]:
        """Windows of some reach (s) around all points; signals with the same reach share them."""
        return lru_cache(1)(partial(TimeWindows, self._reference.time, self.points.time))

    def _half_width(self, name: str, tolerance: Tolerance) -> float:
        return tolerance.half_width(_to_floats(self._reference, name))

    def is_outside(self, name: str, tolerance: Tolerance) -> np.ndarray:
        """Return whether the result is outside the tube around a signal, shape (points,)."""
        values, tube = self.series(name)[0], self.tube(name, tolerance)
        return (values < tube.lower) | (values > tube.upper)

    def compare_signal(self, name: str, tolerance: Tolerance) -> Verdict:
        """Return the verdict on one signal of the reference."""
        if problem := next(self._find_comparison_problems(name), None):
            return problem
        if self._result[name].dtype == object:
            return self._compare_texts(name)
        return self._compare_numbers(name, tolerance)

    def _find_comparison_problems(self, name: str) -> Iterator[Verdict]:
        """Yield the reasons why a signal cannot be compared."""
        if name not in self._result:
            yield Verdict(name, f"is missing{did_you_mean(name, self._result)}")
            return
        if text := self._coverage_problem:
            yield Verdict(name, text)
        runs = {"result": self._result, "reference": self._reference}
        texts = [role for role, run in runs.items() if run[name].dtype == object]
        if len(texts) == 1:
            yield Verdict(name, f"holds text in the {texts[0]}, and numbers in the other")
        if not texts:
            yield from self._find_non_finite(
                name,
                "result",
                self.points.time,
                self.points.interpolate_result(_to_floats(self._result, name)),
            )
            yield from self._find_non_finite(
                name, "reference", self._reference.time, _to_floats(self._reference, name)
            )

    @cached_property
    def _coverage_problem(self) -> str:
        """Description of a result that does not cover the time of the reference; "" if it does."""
        time, expected = self._result.time, self._reference.time
        margin = time_tolerance(expected)
        if time[0] - margin <= expected[0] and expected[-1] <= time[-1] + margin:
            return ""
        return (
            f"covers {time[0]:g} s to {time[-1]:g} s only, the reference {expected[0]:g} s to "
            f"{expected[-1]:g} s"
        )

    @staticmethod
    def _find_non_finite(
        name: str, role: str, time: np.ndarray, values: np.ndarray
    ) -> Iterator[Verdict]:
        """Yield a verdict on the first value that is NaN or infinite."""
        rows = np.flatnonzero(~np.isfinite(values))
        if rows.size:
            row = rows[0]
            yield Verdict(
                name, f"is {values[row]} at t = {time[row]:g} s in the {role}", float(time[row])
            )

    def _compare_texts(self, name: str) -> Verdict:
        """Compare strings, which hold until the next row, at the rows of both runs."""
        own, other = self._result.time, self._reference.time
        covered = own[
            (own >= other[0] - time_tolerance(other)) & (own <= other[-1] + time_tolerance(other))
        ]
        time = np.union1d(covered, other)
        actual, expected = (
            run[name][np.searchsorted(run.time, time + time_tolerance(time), "right") - 1]
            for run in (self._result, self._reference)
        )
        different = np.flatnonzero(actual != expected)
        if not different.size:
            return Verdict(name, excess=-math.inf)
        row = different[0]
        return Verdict(
            name,
            f'is "{actual[row]}" at t = {time[row]:g} s, expected "{expected[row]}"',
            float(time[row]),
        )

    def _compare_numbers(self, name: str, tolerance: Tolerance) -> Verdict:
        """Compare numbers.

        The tube is computed only at points where the deviation exceeds the half height of the tube.
        """
        values, reference = self.series(name)
        half_width = self._half_width(name, tolerance)
        deviation = np.abs(values - self.points.interpolate_reference(reference))
        distant = np.flatnonzero(deviation > half_width)
        rows = distant if distant.size < DENSE_FRACTION * deviation.size else slice(None)
        tube = self._tube(reference, half_width, tolerance.time, rows)
        distance = np.maximum(tube.lower - values[rows], values[rows] - tube.upper)
        if distance.max(initial=0) > 0:
            return self._tube_violation(name, tube, values[rows], distance, half_width)
        return Verdict(
            name,
            time=math.inf,
            excess=_relative_excess(min(float(deviation.max()) - half_width, 0.0), half_width),
        )

    def _tube_violation(
        self, name: str, tube: Tube, values: np.ndarray, distance: np.ndarray, half_width: float
    ) -> Verdict:
        """Return the verdict on a signal with a positive `distance` from the tube somewhere."""
        outside = np.flatnonzero(distance > 0)
        row, worst, unit = outside[0], int(distance.argmax()), self._unit_suffix(name)
        time, excess = float(tube.time[row]), _relative_excess(distance[worst], half_width)
        share = f"{outside.size} of {self.points.time.size} points outside"
        expected = float(np.interp(time, self._reference.time, _to_floats(self._reference, name)))
        if (
            half_width < 1
            and self._is_discrete(name)
            and expected.is_integer()
            and float(values[row]).is_integer()
        ):
            return Verdict(
                name,
                f"is {values[row]:g} at t = {time:g} s, expected {expected:g}; {share}",
                time,
                excess,
            )
        side, bound = (
            ("above", tube.upper) if values[row] > tube.upper[row] else ("below", tube.lower)
        )
        text = (
            f"leaves its tube at t = {time:g} s: {values[row]:.6g}{unit} is "
            f"{distance[row]:.3g}{unit} {side} "
            f"its limit {bound[row]:.6g}{unit}; at most {distance[worst]:.3g}{unit} outside, at t "
            f"= {tube.time[worst]:g} s; "
            f"{share}"
        )
        return Verdict(name, text, time, excess)

    def _is_discrete(self, name: str) -> bool:
        """Return whether all values of both runs are integers without unit, such as Booleans."""
        runs = (_to_floats(self._result, name), _to_floats(self._reference, name))
        return not self._unit_suffix(name) and all(
            np.array_equal(values, np.round(values)) for values in runs
        )

    def _unit_suffix(self, name: str) -> str:
        unit = self._unit(name)
        return f" {unit}" if unit and unit != "1" else ""

    def _unit(self, name: str) -> str:
        return self._result.units.get(name) or self._reference.units.get(name) or ""


def _to_floats(run: Result, name: str) -> np.ndarray:
    return run[name].astype(np.float64, copy=False)


def _relative_excess(distance: float, half_width: float) -> float:
    if half_width > 0:
        return float(distance) / half_width
    return math.inf if distance > 0 else 0.0


#: largest number of failures that `Comparison.shortened` lists
MAX_LISTED_FAILURES = 10


class Verdict(NamedTuple):
    """Verdict on one signal.

    Attributes:
        signal: Name of the signal.
        problem: Description of the first deviation; "" if the signal passes.
        time: Time of the first deviation (s): -inf if it has no time, inf if there is none.
        excess: Largest distance outside the tube in half heights of the tube; inf if nothing can be
            compared or the height is 0. If no point is outside, a number from -1 (on the reference)
            to 0 (half a height from it).
    """

    signal: str
    problem: str = ""
    time: float = -math.inf
    excess: float = math.inf

    @property
    def passed(self) -> bool:
        """True if the signal has no problem."""
        return not self.problem

    def __str__(self) -> str:
        return f"{self.signal} {self.problem or 'stays in its tube'}"


@dataclass(frozen=True)
class Comparison:
    """Verdicts on the comparison and on patterns, then on signals in the reference's order."""

    verdicts: tuple[Verdict, ...]

    @property
    def passed(self) -> bool:
        """True if at least one signal was compared and all passed."""
        return bool(self.verdicts) and all(verdict.passed for verdict in self.verdicts)

    @property
    def failures(self) -> list[Verdict]:
        """Verdicts that failed, the earliest first."""
        return sorted(
            (verdict for verdict in self.verdicts if not verdict.passed),
            key=lambda verdict: verdict.time,
        )

    @property
    def worst(self) -> list[Verdict]:
        """Verdicts on all signals that were compared with a tube, the largest excess first."""
        return sorted(
            (verdict for verdict in self.verdicts if verdict.time > -math.inf),
            key=lambda verdict: -verdict.excess,
        )

    def __str__(self) -> str:
        """Return a summary in one line, and one line per failure."""
        return "\n".join(self._lines(len(self.verdicts)))

    def shortened(self) -> str:
        """Return the same with the earliest failures only, and the number of those left out."""
        return "\n".join(self._lines(MAX_LISTED_FAILURES))

    def _lines(self, listed: int) -> list[str]:
        failures = self.failures
        if not self.verdicts:
            return ["nothing was compared"]
        if not failures:
            return [f"{count_noun(len(self.verdicts), 'signal')} compared, none leaves its tube"]
        more = [f"... and {len(failures) - listed} more"] if len(failures) > listed else []
        return [
            f"{len(failures)} of {count_noun(len(self.verdicts), 'signal')} failed",
            *map(str, failures[:listed]),
            *more,
        ]
