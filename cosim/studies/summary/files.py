"""The files of a sweep: table, aggregates, rates of success, failures, and what made them."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from os.path import normpath
from pathlib import Path
from typing import Any

from ...results.files import remove, write_json
from ..execution.bundle import identity
from ..execution.run_store import Ledger
from ..schema import AGGREGATES, SUCCESS
from ..sweep import Row, Sweep, kpi_names
from .statistics import Group, causes, groupings, groups
from .table import write_csv, write_parquet, write_rows


@dataclass(frozen=True)
class Summary:
    """What a sweep comes to: groups of runs (the first holds all of them), and causes of failures."""

    finished: int
    groups: list[Group]
    causes: list[tuple[str, int, int]]

    @property
    def failed(self) -> int:
        return self.groups[0].failed if self.groups else 0


def write(sweep: Sweep, ledger: Ledger, folder: Path, parquet: bool) -> Summary:
    """Write table.csv, aggregates.csv, success.csv, failures.csv and sweep.json to a folder; no older table stays."""
    factors, kpis = sweep.design.columns, kpi_names(sweep.rows(ledger))

    def rows() -> Iterator[Row]:
        return sweep.rows(ledger)

    write_csv(rows, factors, kpis, folder / "table.csv")
    if parquet:
        write_parquet(rows, factors, kpis, folder / "table.parquet")
    else:
        remove(folder, "table.parquet")
    found, statistics = [], []
    for names in groupings(sweep.design, sweep.read.spec.by):
        for group in groups(rows, names):
            statistics += [_statistic(group, factors, kpi, numbers) for kpi, numbers in group.statistics()]
            group.kpis = group.kpis if not names else {}
            found.append(group)
    write_rows([*factors, *AGGREGATES], statistics, folder / "aggregates.csv")
    write_rows([*factors, *SUCCESS], (_success(group, factors) for group in found), folder / "success.csv")
    write_rows(["run", *factors, "failure", "output", "command"], _failures(sweep, rows()), folder / "failures.csv")
    summary = Summary(found[0].runs if found else 0, found, causes(rows()))
    write_json(_description(sweep, summary), folder / "sweep.json")
    return summary


def _statistic(group: Group, factors: list[str], kpi: str, numbers: dict[str, float]) -> list[Any]:
    return [*(group.labels.get(name) for name in factors), kpi, *numbers.values()]


def _success(group: Group, factors: list[str]) -> list[Any]:
    labels = (group.labels.get(name) for name in factors)
    return [*labels, group.runs, group.distinct, group.failed, group.passed, group.rate, *group.interval]


def _failures(sweep: Sweep, rows: Iterator[Row]) -> Iterator[list[Any]]:
    for row in rows:
        if row.record.failure:
            command = run_command(sweep.read.scenario, sweep.study.job(row.point.settings).settings)
            yield [row.run, *row.point.labels.values(), row.record.failure, row.record.output, command]


def run_command(scenario: Path, settings: Any) -> str:
    """The command that makes this run alone."""
    words = [word for name, value in settings.items() for word in ("--set", f"{name}={_text(value)}")]
    return shlex.join(["cosim", "run", normpath(scenario), *words])


def _text(value: Any) -> str:
    """As `--set` takes it: JSON, or a text that is none."""
    try:
        json.loads(value)
    except (TypeError, ValueError):
        return value if isinstance(value, str) else json.dumps(value)
    return json.dumps(value)


def _description(sweep: Sweep, summary: Summary) -> dict[str, Any]:
    spec = sweep.read.spec
    return {
        "name": spec.name,
        "sweep": sweep.read.document.value,
        "scenario_file": str(sweep.read.scenario.resolve()),
        "cosim": identity(),
        "sha256": dict(sweep.study.bundle.files),
        "success": sweep.criteria,
        "runs": len(sweep),
        "finished": summary.finished,
        "failed": summary.failed,
        "passed": summary.groups[0].passed if summary.groups else 0,
    }
