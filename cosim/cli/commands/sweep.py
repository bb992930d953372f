"""`cosim sweep`: runs of a scenario at all points of a design."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from ...core.errors import CosimError, InputError
from ...core.resources import available_processors
from ...core.text import count_noun
from ...report.tables import print_table
from .. import current_command_line, study_options
from ..messages import print_json, warn_overwriting
from ..options import complete_study, flag_option, json_option, output_dir_option

if TYPE_CHECKING:
    from ...studies.execution.run_store import RunStore
    from ...studies.summary.sweep_files import SweepSummary
    from ...studies.sweep import Sweep

T = TypeVar("T")

#: largest numbers of groups and of causes of failure that are printed; the files hold all of them
_MAX_PRINTED = 20


@click.command()
@click.argument("sweep", shell_complete=complete_study)
@output_dir_option
@flag_option("--parquet", help="Also write table.parquet (extra `parquet`).")
@flag_option("--replays", help="Also write the 3-D replay of one run of each cell of the maps.")
@json_option(
    "an object with name, folder, runs, finished, failed, units (by KPI), failure_causes (cause, "
    "runs, first_run), "
    "missed_criteria (kpi, limits, runs, first_run, command) and groups, whose entries have "
    "labels, runs, distinct, passed, "
    "success_rate, interval (95 %) and kpis; the first group is all runs and has the kpis"
)
@study_options.study_options
def command(
    sweep: str, output_dir: Path | None, parquet: bool, replays: bool, as_json: bool, **study: Any
) -> int:
    """Run a scenario at many points: parameter studies and Monte Carlo.

    SWEEP is a JSON file or the name of a shipped sweep. Each run has its own child process. Writes
    table.csv (one row per run), aggregates.csv, success.csv, unsuccessful.csv (criteria that a run
    misses, and the command that repeats it), failures.csv, sweep.json, sweep.html and success maps
    to the output directory. Called again, the command continues an interrupted sweep. Exit code 0:
    all runs reached their end; 1: some failed; 2: the sweep was refused; 130: interrupted, the
    finished runs are written.
    """
    from ...results.parquet_files import require_parquet
    from ...studies.sweep import Sweep

    if parquet:
        require_parquet()
    loaded = Sweep.from_file(sweep, study.pop("max_runs"))
    folder = output_dir or Path("runs") / loaded.study_file.spec.name
    with study_options.open_run_store(folder, study.pop("retry_failed")) as run_store:
        warn_overwriting(folder, "sweep.json", "sweep", loaded.study_file.document.file.resolve())
        return _run_sweep(loaded, run_store, folder, parquet, replays, as_json, **study)


def _run_sweep(
    sweep: Sweep,
    run_store: RunStore,
    folder: Path,
    parquet: bool,
    replays: bool,
    as_json: bool,
    workers: int | None,
    scheduler: str | None,
) -> int:
    from ...studies.summary.sweep_files import write_sweep_files

    began, interrupted = time.monotonic(), False
    done = sum(key in run_store for key in sweep.keys)
    if done < len(sweep):
        try:
            with study_options.running_study(sweep.study, len(sweep), workers, scheduler, done) as (
                runner,
                progress,
            ):
                sweep.run(run_store, runner, progress)
        except KeyboardInterrupt:
            interrupted = True
        except CosimError as error:
            if error.exit_code != InputError.exit_code:
                write_sweep_files(sweep, run_store, folder, parquet)
            raise
    if not interrupted:
        sweep.check_names(run_store)
    summary = write_sweep_files(sweep, run_store, folder, parquet)
    _write_maps_and_page(sweep, run_store, summary, folder, replays and not interrupted, workers)
    if as_json:
        print_json(_summary_as_json(sweep, summary, folder))
    else:
        _print_summary(sweep, summary)
        new = (
            f"{summary.finished - done} made now in "
            f"{study_options.format_duration(time.monotonic() - began)}"
        )
        runs = count_noun(len(sweep), "run")
        click.echo(
            f"{summary.finished} of {runs}, {new}, {summary.failed} failed; table.csv and others "
            f"in {folder}"
        )
    if interrupted:
        raise KeyboardInterrupt
    return 1 if summary.failed else 0


def _write_maps_and_page(
    sweep: Sweep,
    run_store: RunStore,
    summary: SweepSummary,
    folder: Path,
    replays: bool,
    workers: int | None,
) -> None:
    """Write the maps, the replays of their cells if required, and the page."""
    from ...studies.summary.page import remove_foreign_replays, write_replays, write_sweep_page
    from ...studies.summary.success_map import success_maps

    maps = success_maps(sweep, sweep.rows(run_store))
    remove_foreign_replays(sweep, folder)
    if replays:
        shown = []
        for each in maps:
            found = [cell.representative_run for cell in each.cells.values()]
            shown += [run.number for run in found if run]
        failed = write_replays(sweep, shown, folder, workers or available_processors())
        for number, cause in failed.items():
            click.echo(f"no replay of run {number}: {cause}", err=True)
    write_sweep_page(sweep, sweep.rows(run_store), summary, maps, folder)


def _print_summary(sweep: Sweep, summary: SweepSummary) -> None:
    if not summary.groups:
        return
    numbers = summary.groups[0].shown_statistics()
    columns = ("mean", "std", "min", "median", "max")
    if numbers:
        select = itemgetter(*columns)
        rows = [[name, summary.units.get(name, ""), *select(found)] for name, found in numbers]
        print_table(["KPI", "unit", *columns], rows)
    if sweep.criteria or summary.failed:
        rows = []
        for group in _first(summary.groups, "success.csv"):
            label = ", ".join(f"{name} = {value}" for name, value in group.labels.items())
            rate, low, high = (100 * share for share in (group.success_rate, *group.interval))
            interval = f"{low:.1f} ... {high:.1f} %"
            rows.append([label or "all", str(group.runs), f"{rate:.1f} %", interval])
        print_table(["runs", "n", "success", "95 % interval"], rows)
        if summary.groups[0].distinct < summary.groups[0].runs:
            runs = count_noun(summary.groups[0].runs, "run")
            click.echo(
                f"{summary.groups[0].distinct} of {runs} are distinct; only these count in the "
                "intervals"
            )
    for each in _first(summary.missed_criteria, "sweep.html"):
        runs = f"{each.runs} of {count_noun(summary.finished, 'run')}"
        click.echo(
            f"{each.kpi} {each.limits}: missed by {runs}; the first is run {each.first_run}:\n  "
            f"{each.command}"
        )
    for cause, count, first in _first(summary.failure_causes, "failures.csv"):
        click.echo(f"{count} failed, first run {first}: {cause}", err=True)


def _first(entries: Sequence[T], file: str) -> Iterator[T]:
    """Yield the first entries (with --verbose all), and print how many are left out."""
    count = len(entries) if current_command_line().verbosity > 0 else _MAX_PRINTED
    yield from entries[:count]
    if len(entries) > count:
        click.echo(f"{len(entries) - count} more in {file}; --verbose prints all")


def _summary_as_json(sweep: Sweep, summary: SweepSummary, folder: Path) -> dict[str, Any]:
    keys = ("labels", "runs", "distinct", "passed", "success_rate", "interval")
    groups = []
    for group in summary.groups:
        values = {key: getattr(group, key) for key in keys}
        groups.append({**values, "kpis": dict(group.statistics())})
    return {
        "name": sweep.study_file.spec.name,
        "folder": folder,
        "runs": len(sweep),
        "finished": summary.finished,
        "failed": summary.failed,
        "units": dict(summary.units),
        "failure_causes": [
            {"cause": cause, "runs": count, "first_run": first}
            for cause, count, first in summary.failure_causes
        ],
        "missed_criteria": [each._asdict() for each in summary.missed_criteria],
        "groups": groups,
    }
