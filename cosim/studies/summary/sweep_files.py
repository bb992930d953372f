"""Files of a sweep.

Table, aggregates, success rates, runs without success, failures, and metadata.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

from ...results.files import remove_files, write_json
from ..execution.bundle import cosim_fingerprint
from ..execution.run_store import RunStore
from ..factor_schema import AGGREGATE_COLUMNS, SUCCESS_COLUMNS
from ..sweep import Sweep, SweepRow, kpi_names
from .statistics import RunGroup, failure_causes, group_rows, groupings
from .table import write_csv, write_csv_rows, write_parquet
from .unsuccessful_runs import (
    MissedCriterion,
    UnsuccessfulRun,
    format_run_command,
    missed_criteria,
    unsuccessful_runs,
)

#: largest number of runs without success in a summary
_MAX_LISTED_RUNS = 50


@dataclass(frozen=True)
class SweepSummary:
    """Summary of a sweep.

    Attributes:
        finished: number of finished runs.
        groups: groups of runs; the first one holds all of them.
        failure_causes: cause, number of runs and first run.
        units: units of the KPIs that have one.
        missed_criteria: criteria of success that runs miss.
        unsuccessful_runs: the first runs that reached their end without success.
    """

    finished: int
    groups: list[RunGroup]
    failure_causes: list[tuple[str, int, int]]
    units: Mapping[str, str]
    missed_criteria: list[MissedCriterion]
    unsuccessful_runs: list[UnsuccessfulRun]

    @property
    def unsuccessful(self) -> int:
        """Number of runs that reached their end without success."""
        return (
            self.groups[0].runs - self.groups[0].failed - self.groups[0].passed
            if self.groups
            else 0
        )

    @property
    def failed(self) -> int:
        """Number of failed runs."""
        return self.groups[0].failed if self.groups else 0


def write_sweep_files(
    sweep: Sweep, run_store: RunStore, folder: Path, parquet: bool
) -> SweepSummary:
    """Write the tables of a sweep and sweep.json, and return the summary.

    The tables are table.csv, aggregates.csv, success.csv, unsuccessful.csv and failures.csv.

    With `parquet`, table.parquet is written, too; else an older one is removed.
    """
    factors, kpis = sweep.design.columns, kpi_names(sweep.rows(run_store))

    def rows() -> Iterator[SweepRow]:
        return sweep.rows(run_store)

    write_csv(rows, factors, kpis, folder / "table.csv")
    if parquet:
        write_parquet(rows, factors, kpis, folder / "table.parquet")
    else:
        remove_files(folder, "table.parquet")
    groups, statistics, success = [], list[list[Any]](), list[list[Any]]()
    for names in groupings(sweep.design, sweep.study_file.spec.by):
        for group in group_rows(rows, names):
            labels = [group.labels.get(name) for name in factors]
            for kpi, numbers in group.statistics():
                statistics.append([*labels, kpi, *numbers.values()])
            counts = (group.runs, group.distinct, group.failed, group.passed)
            success.append([*labels, *counts, group.success_rate, *group.interval])
            group.kpis = group.kpis if not names else {}
            groups.append(group)
    write_csv_rows([*factors, *AGGREGATE_COLUMNS], statistics, folder / "aggregates.csv")
    write_csv_rows([*factors, *SUCCESS_COLUMNS], success, folder / "success.csv")
    units = run_store.units
    unsuccessful = (
        [each.run, *each.labels.values(), "; ".join(each.missed), each.command]
        for each in unsuccessful_runs(sweep, rows(), units)
    )
    write_csv_rows(
        ["run", *factors, "missed", "command"], unsuccessful, folder / "unsuccessful.csv"
    )
    write_csv_rows(
        ["run", *factors, "failure", "output", "command"],
        _failure_rows(sweep, rows()),
        folder / "failures.csv",
    )
    summary = SweepSummary(
        groups[0].runs if groups else 0,
        groups,
        failure_causes(rows()),
        units,
        missed_criteria(sweep, rows(), units),
        list(islice(unsuccessful_runs(sweep, rows(), units), _MAX_LISTED_RUNS)),
    )
    spec, document = sweep.study_file.spec, sweep.study_file.document
    metadata = {
        "name": spec.name,
        "sweep": document.value,
        "sweep_file": str(document.file.resolve()),
        "scenario_file": str(sweep.study_file.scenario.resolve()),
        "cosim": cosim_fingerprint(),
        "sha256": dict(sweep.study.bundle.files),
        "success": sweep.criteria,
        "units": dict(units),
        "runs": len(sweep),
        "finished": summary.finished,
        "failed": summary.failed,
        "passed": groups[0].passed if groups else 0,
    }
    write_json(metadata, folder / "sweep.json")
    return summary


def _failure_rows(sweep: Sweep, rows: Iterator[SweepRow]) -> Iterator[list[Any]]:
    for row in rows:
        if row.record.failure:
            settings = sweep.study.job(row.point.settings).settings
            command = format_run_command(sweep.study_file.scenario, settings)
            labels, record = row.point.labels.values(), row.record
            yield [row.run, *labels, record.failure, record.output, command]
