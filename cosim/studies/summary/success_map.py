"""Maps of success: shares of successes over two factors, in panels by up to two further ones."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

from ..design import Design
from ..schema import MapSpec
from ..sweep import Sweep, SweepRow
from .statistics import ConfidenceInterval, wilson_interval

#: the name of a map, with a number behind it where there are several
MAP_NAME = "success_map"


class MapRun(NamedTuple):
    """What a map knows of a run; `value` is that of the KPI which ranks successes, `key` is the same for the same run."""

    number: int
    passed: bool
    value: float
    key: str


@dataclass(frozen=True)
class MapCell:
    """Runs that share their labels."""

    labels: Mapping[str, Any]
    runs: Sequence[MapRun]
    #: the KPI which ranks successes; empty: none does
    ranking_kpi: str = ""

    @property
    def passed(self) -> int:
        return sum(run.passed for run in self.runs)

    @property
    def success_rate(self) -> float:
        """Of successes; NaN without runs."""
        return self.passed / len(self.runs) if self.runs else math.nan

    @property
    def interval(self) -> ConfidenceInterval:
        """Of the share, as many runs as are distinct having been made."""
        distinct = len({run.key for run in self.runs})
        return wilson_interval(self.passed * distinct / max(1, len(self.runs)), distinct)

    @cached_property
    def representative_run(self) -> MapRun | None:
        """The run to show: the first that is no success, else the median one."""
        if lost := [run for run in self.runs if not run.passed]:
            return lost[0]
        ranked = sorted(self.runs, key=lambda run: (run.value, run.number))
        return ranked[(len(ranked) - 1) // 2] if ranked else None

    @property
    def selection_reason(self) -> str:
        """Why this run is shown."""
        if self.passed < len(self.runs):
            return "the first that is no success"
        return f"the median of {self.ranking_kpi}" if self.ranking_kpi else "the middle one"


@dataclass(frozen=True)
class SuccessMap:
    """A map with its cells; one is there for every combination of levels, also where nothing has been run."""

    name: str
    spec: MapSpec
    levels: Mapping[str, Sequence[Any]]
    #: by the labels of the spec's factors, as JSON: Python takes 1, 1.0 and true for the same
    cells: Mapping[str, MapCell]

    def axis_labels(self, factor: str | None) -> Sequence[Any]:
        """Labels along an axis; one None where the map has no such factor."""
        return self.levels[factor] if factor is not None else [None]

    def cell(self, row: Any, column: Any, y: Any, x: Any) -> MapCell:
        """By labels; None for what the map does not tell apart."""
        spec = self.spec
        axes = zip((spec.rows, spec.columns, spec.y, spec.x), (row, column, y, x), strict=True)
        return self.cells[_labels_key(label for factor, label in axes if factor is not None)]

    def title(self, factor: str) -> str:
        return self.spec.titles.get(factor, factor)


def success_maps(sweep: Sweep, rows: Iterable[SweepRow]) -> list[SuccessMap]:
    """The maps that a sweep asks for, of its finished runs."""
    specs, kpi = sweep.study_file.spec.maps, ranking_kpi(sweep.criteria)
    found: list[dict[str, list[MapRun]]] = [{} for _ in specs]
    for row in rows if specs else ():
        run = MapRun(row.run, row.passed, float(row.record.kpis.get(kpi, math.nan)), sweep.keys[row.run])
        for spec, cells in zip(specs, found, strict=True):
            cells.setdefault(_labels_key(row.point.labels[name] for name in spec.factors), []).append(run)
    names = [MAP_NAME if len(specs) == 1 else f"{MAP_NAME}_{i + 1}" for i in range(len(specs))]
    return [_build_map(*each, sweep.design, kpi) for each in zip(names, specs, found, strict=True)]


def ranking_kpi(criteria: Iterable[Mapping[str, Any]]) -> str:
    """The first KPI that has a limit; empty: none has."""
    return next((check["kpi"] for check in criteria if "min" in check or "max" in check), "")


def _labels_key(labels: Iterable[Any]) -> str:
    return json.dumps(list(labels))


def _build_map(name: str, spec: MapSpec, runs: Mapping[str, Sequence[MapRun]], design: Design, kpi: str) -> SuccessMap:
    levels = {factor: design.labels(factor) for factor in spec.factors}
    places = product(*levels.values())
    cells = {
        _labels_key(place): MapCell(dict(zip(levels, place, strict=True)), runs.get(_labels_key(place), ()), kpi)
        for place in places
    }
    return SuccessMap(name, spec, levels, cells)
