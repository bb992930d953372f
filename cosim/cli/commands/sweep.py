"""`cosim sweep`: a scenario, run at every point of a design."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import CosimError, InputError
from ...core.processors import available_processors
from .. import study_options

if TYPE_CHECKING:
    from ...studies.execution.run_store import RunStore
    from ...studies.summary.statistics import RunGroup
    from ...studies.summary.sweep_files import SweepSummary
    from ...studies.sweep import Sweep

#: so many groups and causes are printed; the files hold all of them
_MAX_PRINTED = 20


@click.command()
@click.argument("sweep")
@click.option("--output-dir", type=click.Path(path_type=Path), help="Where results go; default: runs/NAME.")
@click.option("--parquet", is_flag=True, help="Write table.parquet too (extra `parquet`).")
@click.option("--replays", is_flag=True, help="Write the 3-D replay of one run of every cell of the maps, too.")
@study_options.study_options
def command(sweep: str, output_dir: Path | None, parquet: bool, replays: bool, **where: Any) -> int:
    """Run SWEEP, a JSON file or the name of a shipped sweep.

    Every run has a child process of its own. Writes table.csv (one row per run), aggregates.csv, success.csv, failures.csv,
    sweep.json, sweep.html and maps of success to the output directory. A sweep that was interrupted or killed goes on where it
    was when it is called again. Exit code 0: all runs were made; 1: some failed; 2: the sweep was refused; 130: interrupted,
    what was finished is written.
    """
    from ...results.parquet_files import require_parquet
    from ...studies.sweep import Sweep

    if parquet:
        require_parquet()
    read = Sweep.from_file(sweep)
    folder = output_dir or Path("runs") / read.study_file.spec.name
    with study_options.open_run_store(folder, where.pop("retry_failed")) as ledger:
        return _run_sweep(read, ledger, folder, parquet, replays, **where)


def _run_sweep(
    sweep: Sweep, ledger: RunStore, folder: Path, parquet: bool, replays: bool, workers: int | None, scheduler: str | None
) -> int:
    from ...process.supervisor import interrupt_on_termination
    from ...studies.summary.sweep_files import write_sweep_files

    began, interrupted = time.monotonic(), False
    done = sum(key in ledger for key in sweep.keys)
    if done < len(sweep):
        try:
            with (
                interrupt_on_termination(),
                study_options.show_progress(len(sweep)) as progress,
                study_options.create_runner(sweep.study, workers, scheduler) as engine,
            ):
                progress.start(done)
                sweep.run(ledger, engine, progress)
        except KeyboardInterrupt:
            interrupted = True
        except CosimError as error:
            if error.exit_code != InputError.exit_code:
                write_sweep_files(sweep, ledger, folder, parquet)
            raise
    if not interrupted:
        sweep.check_names(ledger)
    summary = write_sweep_files(sweep, ledger, folder, parquet)
    _write_maps_and_page(sweep, ledger, summary, folder, replays and not interrupted, workers)
    _print_summary(sweep, summary)
    made = f"{summary.finished - done} made now in {study_options.format_duration(time.monotonic() - began)}"
    click.echo(f"{summary.finished} of {len(sweep)} runs, {made}, {summary.failed} failed; table.csv and others in {folder}")
    if interrupted:
        raise KeyboardInterrupt
    return 1 if summary.failed else 0


def _write_maps_and_page(
    sweep: Sweep, ledger: RunStore, summary: SweepSummary, folder: Path, replays: bool, workers: int | None
) -> None:
    """Maps, replays of their cells, and the page."""
    from ...studies.summary.page import write_sweep_page
    from ...studies.summary.replays import write_replays
    from ...studies.summary.success_map import success_maps

    maps = success_maps(sweep, sweep.rows(ledger))
    if replays:
        runs = [cell.representative_run.number for each in maps for cell in each.cells.values() if cell.representative_run]
        for run, cause in write_replays(sweep, runs, folder, workers or available_processors()).items():
            click.echo(f"no replay of run {run}: {cause}", err=True)
    write_sweep_page(sweep, summary, maps, folder)


def _print_summary(sweep: Sweep, summary: SweepSummary) -> None:
    if not summary.groups:
        return
    numbers = summary.groups[0].statistics()
    kpis = [[name, *(f"{found[key]:.4g}" for key in ("mean", "std", "min", "median", "max"))] for name, found in numbers]
    if kpis:
        study_options.print_table(["KPI", "mean", "std", "min", "median", "max"], kpis)
    if sweep.criteria or summary.failed:
        study_options.print_table(
            ["runs", "n", "success", "95 % interval"], [_success_row(group) for group in summary.groups[:_MAX_PRINTED]]
        )
        if summary.groups[0].distinct < summary.groups[0].runs:
            click.echo(
                f"{summary.groups[0].distinct} of {summary.groups[0].runs} runs are distinct; intervals are those of so many"
            )
    for cause, count, first in summary.failure_causes[:_MAX_PRINTED]:
        click.echo(f"{count} failed, the first is run {first}: {cause}", err=True)


def _success_row(group: RunGroup) -> list[str]:
    label = ", ".join(f"{name} = {value}" for name, value in group.labels.items()) or "all"
    low, high = group.interval
    return [label, str(group.runs), f"{100 * group.success_rate:.1f} %", f"{100 * low:.1f} ... {100 * high:.1f} %"]
