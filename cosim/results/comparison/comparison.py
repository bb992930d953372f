"""A result against its reference, signal by signal."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...core.errors import InputError, did_you_mean
from .. import Result
from .tube import ComparisonPoints, TimeWindows, Tolerance, Tube, UniformTimeWindows, time_tolerance, uniform_spacing

#: a share of all points that is quicker to look at on its own
DENSE_FRACTION = 0.1


class Verdict(NamedTuple):
    """What became of one signal: `problem` says how it fails, "" when it does not.

    `time` (s) is when it first does: -inf when that has no time, inf when it never does. `excess` is the largest distance
    outside the tube in half widths of the tube, inf where nothing can be compared or the tube has no width. Where nothing is
    outside, it is at most 0, and says how far values are from the reference at their own time: -1 on it.
    """

    signal: str
    problem: str = ""
    time: float = -math.inf
    excess: float = math.inf

    @property
    def passed(self) -> bool:
        return not self.problem

    def __str__(self) -> str:
        return f"{self.signal} {self.problem or 'stays in its tube'}"


@dataclass(frozen=True)
class Comparison:
    """The verdicts on all signals, in the order of the reference; what could not be compared comes first."""

    verdicts: tuple[Verdict, ...]

    @property
    def passed(self) -> bool:
        """Whether something was compared and nothing fails."""
        return bool(self.verdicts) and all(verdict.passed for verdict in self.verdicts)

    @property
    def failures(self) -> list[Verdict]:
        """Those that fail, the earliest first."""
        return sorted((verdict for verdict in self.verdicts if not verdict.passed), key=lambda verdict: verdict.time)

    @property
    def worst(self) -> list[Verdict]:
        """All signals with a tube that the result has too, the one farthest out of it first."""
        return sorted((verdict for verdict in self.verdicts if verdict.time > -math.inf), key=lambda verdict: -verdict.excess)

    def __str__(self) -> str:
        """One line for the whole, and one for each failure."""
        failures = self.failures
        if not self.verdicts:
            return "nothing was compared"
        if not failures:
            return f"all {len(self.verdicts)} signals stay in their tubes"
        return "\n".join([f"{len(failures)} of {len(self.verdicts)} signals fail", *map(str, failures)])


def compare(result: Result, reference: Result, tolerances: Mapping[str, Tolerance]) -> Comparison:
    """Hold the signals of `reference` that match a pattern of `tolerances` against those of `result`.

    "*" in a pattern matches anything, dots too; of several patterns that match, the last one counts. A signal fails when it
    leaves its tube (see `tube`), is missing, does not cover the time of the reference, or is NaN or infinite in either; texts
    fail where they are not equal. A pattern that matches nothing fails as well, so a comparison of nothing does not pass.
    Raises InputError for tolerances that are negative, NaN or infinite.
    """
    if problems := list(_find_tolerance_problems(tolerances)):
        raise InputError(problems)
    chosen = match_tolerances(tolerances, list(reference))
    idle = [pattern for pattern in tolerances if not reference.signals(pattern)]
    general = [
        Verdict(f'"{pattern}"', f"matches no signal of the reference{did_you_mean(pattern, reference)}") for pattern in idle
    ]
    if not len(reference.time) or not len(result.time):
        return Comparison((*general, Verdict("the reference" if not len(reference.time) else "the result", "has no rows")))
    comparer = Comparer(result, reference)
    return Comparison((*general, *(comparer.compare_signal(name, tolerance) for name, tolerance in chosen.items())))


def _find_tolerance_problems(tolerances: Mapping[str, Tolerance]) -> Iterator[str]:
    for pattern, tolerance in tolerances.items():
        for name, value in tolerance._asdict().items():
            if not 0 <= value < math.inf:
                yield f'tolerance of "{pattern}": "{name}" is {value}, expected a finite number of at least 0'


def match_tolerances(tolerances: Mapping[str, Tolerance], names: list[str]) -> dict[str, Tolerance]:
    """The tolerance of each of `names` that matches a pattern, in their order."""
    patterns = [
        (re.compile(".*".join(map(re.escape, pattern.split("*")))), tolerance) for pattern, tolerance in tolerances.items()
    ]
    found = ((name, [tolerance for pattern, tolerance in patterns if pattern.fullmatch(name)]) for name in names)
    return {name: matches[-1] for name, matches in found if matches}


class Comparer:
    """Compares signals of two results, neither of them without rows; what depends on times alone is worked out once."""

    def __init__(self, result: Result, reference: Result):
        self._result, self._reference = result, reference

    @cached_property
    def points(self) -> ComparisonPoints:
        return ComparisonPoints(self._result.time, self._reference.time)

    def tube(self, name: str, tolerance: Tolerance, rows: slice | np.ndarray = slice(None)) -> Tube:
        """The tube around a signal of the reference at `points`, or at some of them."""
        time = self.points.time[rows]
        reference = _to_floats(self._reference, name)
        if self._spacing and isinstance(rows, slice):
            lower, upper = UniformTimeWindows(self._spacing, tolerance.time).extremes(reference)
        else:
            lower, upper = TimeWindows(self._reference.time, time, tolerance.time).extremes(reference)
        half_width = tolerance.half_width(reference)
        return Tube(time, lower - half_width, upper + half_width)

    @cached_property
    def _spacing(self) -> float:
        """The distance between points (s) where they are the rows of the reference, all at even distances, else 0."""
        return uniform_spacing(self.points.time) if np.array_equal(self.points.time, self._reference.time) else 0.0

    def is_outside(self, name: str, tolerance: Tolerance) -> np.ndarray:
        """Whether the result is outside the tube around a signal, at each of `points`."""
        tube, values = self.tube(name, tolerance), self.points.interpolate_result(_to_floats(self._result, name))
        return (values < tube.lower) | (values > tube.upper)

    def compare_signal(self, name: str, tolerance: Tolerance) -> Verdict:
        if problem := next(self._find_comparison_problems(name), None):
            return problem
        if self._result[name].dtype == object:
            return self._compare_texts(name)
        return self._compare_numbers(name, tolerance)

    def _find_comparison_problems(self, name: str) -> Iterator[Verdict]:
        """Why a signal cannot be compared."""
        if name not in self._result:
            yield Verdict(name, f"is missing{did_you_mean(name, self._result)}")
            return
        if text := self._coverage_problem:
            yield Verdict(name, text)
        runs = {"result": self._result, "reference": self._reference}
        texts = [who for who, run in runs.items() if run[name].dtype == object]
        if len(texts) == 1:
            yield Verdict(name, f"holds text in the {texts[0]}, and numbers in the other")
        if not texts:
            yield from self._find_non_finite(
                name, "result", self.points.time, self.points.interpolate_result(_to_floats(self._result, name))
            )
            yield from self._find_non_finite(name, "reference", self._reference.time, _to_floats(self._reference, name))

    @cached_property
    def _coverage_problem(self) -> str:
        """How the result is too short, "" when it is not."""
        own, other = self._result.time, self._reference.time
        margin = time_tolerance(other)
        if own[0] - margin <= other[0] and other[-1] <= own[-1] + margin:
            return ""
        return f"covers {own[0]:g} s to {own[-1]:g} s only, the reference {other[0]:g} s to {other[-1]:g} s"

    @staticmethod
    def _find_non_finite(name: str, who: str, time: np.ndarray, values: np.ndarray) -> Iterator[Verdict]:
        rows = np.flatnonzero(~np.isfinite(values))
        if rows.size:
            row = rows[0]
            yield Verdict(name, f"is {values[row]} at t = {time[row]:g} s in the {who}", float(time[row]))

    def _compare_texts(self, name: str) -> Verdict:
        """Texts hold until the next row; at the rows of both they have to be equal."""
        own, other = self._result.time, self._reference.time
        covered = own[(own >= other[0] - time_tolerance(other)) & (own <= other[-1] + time_tolerance(other))]
        time = np.union1d(covered, other)
        found, expected = (_sample_and_hold(run, name, time) for run in (self._result, self._reference))
        different = np.flatnonzero(found != expected)
        if not different.size:
            return Verdict(name, excess=-math.inf)
        row = different[0]
        return Verdict(name, f'is "{found[row]}" at t = {time[row]:g} s, expected "{expected[row]}"', float(time[row]))

    def _compare_numbers(self, name: str, tolerance: Tolerance) -> Verdict:
        """Most points are close to the reference at their own time: the others alone are held against the tube."""
        values, reference = self.points.interpolate_result(_to_floats(self._result, name)), _to_floats(self._reference, name)
        half_width = tolerance.half_width(reference)
        off = np.abs(values - self.points.interpolate_reference(reference))
        doubtful = np.flatnonzero(off > half_width)
        rows = doubtful if doubtful.size < DENSE_FRACTION * off.size else slice(None)
        tube = self.tube(name, tolerance, rows)
        distance = np.maximum(tube.lower - values[rows], values[rows] - tube.upper)
        if distance.max(initial=0) > 0:
            return self._tube_violation(name, tube, values[rows], distance, half_width)
        return Verdict(name, time=math.inf, excess=_relative_excess(min(float(off.max()) - half_width, 0.0), half_width))

    def _tube_violation(self, name: str, tube: Tube, values: np.ndarray, distance: np.ndarray, half_width: float) -> Verdict:
        outside = np.flatnonzero(distance > 0)
        row, worst, unit = outside[0], int(distance.argmax()), self._unit_suffix(name)
        side, bound = ("above", tube.upper) if values[row] > tube.upper[row] else ("below", tube.lower)
        text = (
            f"leaves its tube at t = {tube.time[row]:g} s: {values[row]:.6g}{unit} is {distance[row]:.3g}{unit} {side} "
            f"{bound[row]:.6g}{unit}; at most {distance[worst]:.3g}{unit} outside, at t = {tube.time[worst]:g} s; "
            f"{outside.size} of {self.points.time.size} points outside"
        )
        return Verdict(name, text, float(tube.time[row]), _relative_excess(distance[worst], half_width))

    def _unit_suffix(self, name: str) -> str:
        unit = self._result.units.get(name) or self._reference.units.get(name)
        return f" {unit}" if unit and unit != "1" else ""


def _to_floats(run: Result, name: str) -> np.ndarray:
    return run[name].astype(np.float64, copy=False)


def _sample_and_hold(run: Result, name: str, time: np.ndarray) -> np.ndarray:
    """Texts at these times."""
    return run[name][np.searchsorted(run.time, time + time_tolerance(time), "right") - 1]


def _relative_excess(distance: float, half_width: float) -> float:
    return float(distance) / half_width if half_width > 0 else math.inf if distance > 0 else 0.0
