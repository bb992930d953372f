"""Maps of success: shares of successes over two factors, in panels by two further ones."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from .aggregate import Interval, wilson
from .design import Design
from .schema import MapSpec
from .sweep import Row

#: labels of a cell's row of panels, column of panels, y and x; None where a map has no such factor
Place = tuple[Any, Any, Any, Any]


@dataclass
class Cell:
    """Runs that share their place in a map, and one of them to show: `why` says which."""

    name: str
    labels: Mapping[str, Any]
    runs: int = 0
    passed: int = 0
    shown: int | None = None
    why: str = ""
    _values: list[tuple[float, int]] = field(default_factory=list, repr=False)

    def add(self, row: Row, kpi: str | None) -> None:
        self.runs += 1
        self.passed += row.passed
        if not row.passed and self.shown is None:
            self.shown, self.why = row.run, "failed" if row.record.failure else "the first that is no success"
        elif kpi is None or not math.isfinite(value := float(row.record.kpis.get(kpi, math.nan))):
            return
        else:
            self._values.append((value, row.run))

    def choose(self, kpi: str | None) -> None:
        """Where all runs are successes, show the median one of a KPI."""
        if self.shown is None and self._values:
            self.shown, self.why = sorted(self._values)[(len(self._values) - 1) // 2][1], f"the median of {kpi}"
        self._values.clear()

    @property
    def share(self) -> float:
        """NaN without runs."""
        return self.passed / self.runs if self.runs else math.nan

    @property
    def interval(self) -> Interval:
        return wilson(self.passed, self.runs)


@dataclass(frozen=True)
class SuccessMap:
    """A map with all its cells: those of `levels` x `levels` x ... in the order of the design, also where nothing was run."""

    name: str
    spec: MapSpec
    levels: Mapping[str, Sequence[Any]]
    cells: Mapping[Place, Cell]

    def along(self, name: str | None) -> Sequence[Any]:
        """Labels along an axis; one None where the map has no such factor."""
        return self.levels[name] if name is not None else [None]
