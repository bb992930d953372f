"""Statistics of many runs.

Distributions of KPIs and success rates, over all runs and by the levels of factors.
"""

import json
import math
from array import array
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...report.tables import format_number
from ..design import Design
from ..factor_schema import QUANTILES
from ..sweep import SweepRow
from .table import RowSource

#: quantile of the normal distribution for a confidence of 95 %
_Z_95 = 1.959963984540054


class ConfidenceInterval(NamedTuple):
    """Confidence interval of a rate."""

    low: float
    high: float


def wilson_interval(successes: float, count: int) -> ConfidenceInterval:
    """Return Wilson's score interval (95 %) of a rate.

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212.
    """
    if count == 0:
        return ConfidenceInterval(0.0, 1.0)
    rate, z2 = successes / count, _Z_95 * _Z_95
    center = (rate + z2 / (2 * count)) / (1 + z2 / count)
    half = (
        _Z_95 / (1 + z2 / count) * math.sqrt(rate * (1 - rate) / count + z2 / (4 * count * count))
    )
    return ConfidenceInterval(
        0.0 if successes == 0 else center - half, 1.0 if successes == count else center + half
    )


@dataclass
class RunGroup:
    """Group of runs with equal labels of some factors.

    Attributes:
        labels: the common labels by factor.
        runs: number of runs.
        distinct: number of runs, where a run that several points share counts once.
        failed: number of runs that failed.
        passed: number of successes.
        kpis: finite values of each KPI.
        booleans: names of the KPIs with the values true and false.
    """

    labels: Mapping[str, Any]
    runs: int = 0
    distinct: int = 0
    failed: int = 0
    passed: int = 0
    kpis: dict[str, "array[float]"] = field(default_factory=dict)
    booleans: set[str] = field(default_factory=set)
    _shared_keys: set[str] = field(default_factory=set)

    def add(self, row: SweepRow) -> None:
        """Add a finished run."""
        self.runs += 1
        self.distinct += row.record.key not in self._shared_keys
        if row.shared:
            self._shared_keys.add(row.record.key)
        self.failed += bool(row.record.failure)
        self.passed += row.passed
        for name, value in row.record.kpis.items():
            values = self.kpis.setdefault(name, array("d"))
            if isinstance(value, bool):
                self.booleans.add(name)
            if math.isfinite(value):
                values.append(value)

    @property
    def success_rate(self) -> float:
        """Number of successes divided by the number of runs; a failed run is not a success."""
        return self.passed / self.runs

    @property
    def interval(self) -> ConfidenceInterval:
        """Wilson interval of the success rate, counting each distinct run once."""
        return wilson_interval(self.passed * self.distinct / self.runs, self.distinct)

    def statistics(self) -> Iterator[tuple[str, dict[str, float]]]:
        """Yield (KPI, statistics).

        Number of finite values, mean, standard deviation (n - 1) and quantiles.
        """
        for name, column in self.kpis.items():
            values = np.frombuffer(column, np.float64) if column else np.array([math.nan])
            quantiles = dict(
                zip(QUANTILES, np.quantile(values, list(QUANTILES.values())).tolist(), strict=True)
            )
            spread = float(values.std(ddof=1)) if len(column) > 1 else math.nan
            yield (
                name,
                {"count": len(column), "mean": float(values.mean()), "std": spread, **quantiles},
            )

    def shown_statistics(self) -> Iterator[tuple[str, dict[str, str]]]:
        """Yield (KPI, statistics as texts), "-" without a value.

        The mean of a Boolean is the share of true values.
        """
        for name, numbers in self.statistics():
            shown = {key: format_number(value) for key, value in numbers.items()}
            if name in self.booleans:
                shown = {
                    **dict.fromkeys(shown, ""),
                    "count": shown["count"],
                    "mean": f"{100 * numbers['mean']:.3g} %",
                }
            yield name, shown


def groupings(design: Design, by: Iterable[Sequence[str]]) -> list[tuple[str, ...]]:
    """Return the groupings of runs by factors.

    None, each factor that has levels, and those in `by`.
    """
    single = [
        (factor.name,)
        for factor in design.factors
        if factor.grid_levels and (factor.listed_levels or design.unit_samples is None)
    ]
    return list(dict.fromkeys([(), *single, *map(tuple, by)]))


def group_rows(rows: RowSource, names: Sequence[str]) -> list[RunGroup]:
    """Group runs by their labels of these factors, in order of appearance."""
    groups: dict[str, RunGroup] = {}
    for row in rows():
        labels = {name: row.point.labels[name] for name in names}
        groups.setdefault(json.dumps(labels), RunGroup(labels)).add(row)
    return list(groups.values())


def failure_causes(rows: Iterable[SweepRow]) -> list[tuple[str, int, int]]:
    """Return (cause, number of runs, first run) of the failures, the most frequent first."""
    counts: Counter[str] = Counter()
    first: dict[str, int] = {}
    for row in rows:
        if row.record.failure:
            counts[row.record.failure] += 1
            first.setdefault(row.record.failure, row.run)
    return [(cause, count, first[cause]) for cause, count in counts.most_common()]
