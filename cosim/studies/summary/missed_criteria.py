"""Runs of a sweep that reached their end without success.

The criteria that they miss, and the commands that repeat them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from ...results.checks import CheckOutcome
from ..sweep import Sweep, SweepRow
from .run_commands import run_command


class MissedCriterion(NamedTuple):
    """Criterion of success that runs miss.

    Attributes:
        kpi: name of the KPI value.
        limits: limits with their unit, such as "max 0.5 m/s".
        runs: number of runs that miss it.
        first_run: number of the first of them.
        command: command line that makes this run alone.
    """

    kpi: str
    limits: str
    runs: int
    first_run: int
    command: str


class UnsuccessfulRun(NamedTuple):
    """Run that reached its end without success.

    Attributes:
        run: number of the point.
        labels: labels of the factors.
        missed: found values and limits, such as "landing.touchdown_speed is 0.61 m/s, expected at
            most 0.5 m/s".
        command: command line that makes this run alone.
    """

    run: int
    labels: Mapping[str, Any]
    missed: Sequence[str]
    command: str


def criterion_limits(outcome: CheckOutcome, units: Mapping[str, str]) -> str:
    """Return the limits of a criterion with the unit of its KPI."""
    return f"{outcome.limits} {units.get(outcome.check['kpi'], '')}".rstrip()


def missed_criteria(
    sweep: Sweep, rows: Iterable[SweepRow], units: Mapping[str, str]
) -> list[MissedCriterion]:
    """Return the criteria that finished runs miss, the most frequent first.

    Runs that failed are left out.

    Args:
        sweep: the sweep.
        rows: its finished runs.
        units: units of the KPIs that have one.
    """
    counts: dict[tuple[str, str], list[int]] = {}
    for row in rows:
        for outcome in () if row.record.failure else sweep.missed(row.record.kpis):
            counts.setdefault(
                (outcome.check["kpi"], criterion_limits(outcome, units)), [0, row.run]
            )[0] += 1
    found = sorted(counts.items(), key=lambda item: -item[1][0])
    return [
        MissedCriterion(*criterion, runs, first, run_command(sweep, first))
        for criterion, (runs, first) in found
    ]


def unsuccessful_runs(
    sweep: Sweep, rows: Iterable[SweepRow], units: Mapping[str, str]
) -> Iterator[UnsuccessfulRun]:
    """Yield the runs that reached their end without success, in the order of the design.

    `units` are those of the KPIs.
    """
    for row in rows:
        if not row.passed and not row.record.failure:
            missed = [outcome.text(units) for outcome in sweep.missed(row.record.kpis)]
            yield UnsuccessfulRun(row.run, row.point.labels, missed, run_command(sweep, row.run))
