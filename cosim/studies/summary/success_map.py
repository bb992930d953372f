"""Success maps: success rates over two factors, in panels by up to two more."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

from ..schema import MapSpec
from ..sweep import Sweep, SweepRow
from .statistics import ConfidenceInterval, wilson_interval

#: name of a map; several maps have a number appended
MAP_NAME = "success_map"


class MapRun(NamedTuple):
    """Run in a cell of a map.

    `value` is that of the KPI that ranks successes, `key` is equal for equal runs.
    """

    number: int
    passed: bool
    value: float
    key: str


@dataclass(frozen=True)
class MapCell:
    """Cell of a map: the runs with equal labels."""

    labels: Mapping[str, Any]
    runs: Sequence[MapRun]
    #: KPI that ranks successes; empty: none
    ranking_kpi: str = ""

    @property
    def passed(self) -> int:
        """Number of successes."""
        return sum(run.passed for run in self.runs)

    @property
    def success_rate(self) -> float:
        """Number of successes divided by the number of runs; NaN without runs."""
        return self.passed / len(self.runs) if self.runs else math.nan

    @property
    def interval(self) -> ConfidenceInterval:
        """Wilson interval of the success rate, counting each distinct run once."""
        distinct = len({run.key for run in self.runs})
        return wilson_interval(self.passed * distinct / max(1, len(self.runs)), distinct)

    @cached_property
    def representative_run(self) -> MapRun | None:
        """Run shown for the cell: the first unsuccessful one, else the median success.

        None without runs.
        """
        if unsuccessful := [run for run in self.runs if not run.passed]:
            return unsuccessful[0]
        ranked = sorted(self.runs, key=lambda run: (run.value, run.number))
        return ranked[(len(ranked) - 1) // 2] if ranked else None

    @property
    def selection_reason(self) -> str:
        """Reason for the choice of the representative run, as the page shows it."""
        if self.passed < len(self.runs):
            return "the first unsuccessful run"
        return f"the median of {self.ranking_kpi}" if self.ranking_kpi else "the middle one"


@dataclass(frozen=True)
class SuccessMap:
    """Success map with a cell for every combination of levels, including those without runs."""

    name: str
    spec: MapSpec
    levels: Mapping[str, Sequence[Any]]
    #: cells by their labels as JSON text, since 1, 1.0 and True are equal in Python
    cells: Mapping[str, MapCell]

    def axis_labels(self, factor: str | None) -> Sequence[Any]:
        """Return the labels along an axis; [None] if the map has no such factor."""
        return self.levels[factor] if factor is not None else [None]

    def cell(self, row: Any, column: Any, y: Any, x: Any) -> MapCell:
        """Return the cell with these labels; None for an axis that the map does not have."""
        spec = self.spec
        axes = zip((spec.rows, spec.columns, spec.y, spec.x), (row, column, y, x), strict=True)
        return self.cells[_labels_key(label for factor, label in axes if factor is not None)]

    def title(self, factor: str) -> str:
        """Return the title of a factor, by default its name."""
        return self.spec.titles.get(factor, factor)


def success_maps(sweep: Sweep, rows: Iterable[SweepRow]) -> list[SuccessMap]:
    """Build the maps that a sweep file defines from the finished runs."""
    specs, kpi = sweep.study_file.spec.maps, ranking_kpi(sweep.criteria)
    cells_of_maps: list[dict[str, list[MapRun]]] = [{} for _ in specs]
    for row in rows if specs else ():
        run = MapRun(
            row.run, row.passed, float(row.record.kpis.get(kpi, math.nan)), sweep.keys[row.run]
        )
        for spec, runs in zip(specs, cells_of_maps, strict=True):
            runs.setdefault(
                _labels_key(row.point.labels[name] for name in spec.factors), []
            ).append(run)
    maps = []
    for number, (spec, found) in enumerate(zip(specs, cells_of_maps, strict=True), 1):
        levels = {factor: sweep.design.labels(factor) for factor in spec.factors}
        cells = {}
        for labels in product(*levels.values()):
            text = _labels_key(labels)
            named = dict(zip(levels, labels, strict=True))
            cells[text] = MapCell(named, found.get(text, ()), kpi)
        name = MAP_NAME if len(specs) == 1 else f"{MAP_NAME}_{number}"
        maps.append(SuccessMap(name, spec, levels, cells))
    return maps


def ranking_kpi(criteria: Iterable[Mapping[str, Any]]) -> str:
    """Return the first KPI with a limit among the criteria; empty if there is none."""
    return next((check["kpi"] for check in criteria if "min" in check or "max" in check), "")


def _labels_key(labels: Iterable[Any]) -> str:
    return json.dumps(list(labels))
