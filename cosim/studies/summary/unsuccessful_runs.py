"""Runs of a sweep that reached their end without success.

The criteria that they miss, and the commands that repeat them.
"""

import json
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from os.path import normpath
from pathlib import Path
from typing import Any, NamedTuple

from ...core import resources
from ...results.checks import CheckOutcome
from ...scenario.file_paths import SHIPPED, change_pointed, relocating
from ...scenario.schema_types import PathChange
from ..sweep import Sweep, SweepRow


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


def run_command(sweep: Sweep, run: int) -> str:
    """Return the command line that repeats a run with all signals that the scenario records."""
    return format_run_command(sweep.study_file.scenario, run_settings(sweep, run))


def run_settings(sweep: Sweep, run: int) -> dict[str, Any]:
    """Return the settings that repeat a run with all signals that the scenario records.

    A sweep may record only those that it needs.
    """
    settings = sweep.study.job(sweep.design[run].settings).settings
    return {name: value for name, value in settings.items() if not name.startswith("/record")}


def format_run_command(scenario: Path, settings: Any) -> str:
    """Return the command line that makes this run alone in the working directory.

    It refers to a shipped scenario by its name.

    Paths in settings of a study start from the folder of the scenario, those of the option `--set`
    from the working directory.
    """
    change = _path_changes(scenario.parent, Path.cwd())
    moved = {
        name: change_pointed(name, value, change) if name.startswith("/") else value
        for name, value in settings.items()
    }
    words = ["cosim", "run", _scenario_text(scenario)]
    for name, value in moved.items():
        words += ["--set", f"{name}={_setting_text(value)}"]
    return shlex.join(words)


@lru_cache(1)  # a sweep writes a command for each run without success
def _path_changes(folder: Path, working: Path) -> PathChange:
    """Return a function that changes paths relative to the folder.

    They become paths of shipped files, or relative to the working directory.
    """
    to_shipped, to_working = relocating(folder, resources.root()), relocating(folder, working)

    def change(text: str) -> str:
        shipped = to_shipped(text)
        return (
            to_working(text)
            if Path(shipped).is_absolute() or shipped.startswith("..")
            else f"{SHIPPED}{shipped}"
        )

    return change


@lru_cache(1)
def _scenario_text(scenario: Path) -> str:
    is_shipped = scenario.resolve().parent == (resources.root() / "scenarios").resolve()
    return scenario.stem if is_shipped else normpath(scenario)


def _setting_text(value: Any) -> str:
    """Return a value as `--set` reads it: JSON, or a string that is not JSON."""
    try:
        json.loads(value)
    except (TypeError, ValueError, RecursionError):
        return value if isinstance(value, str) else json.dumps(value)
    return json.dumps(value)
