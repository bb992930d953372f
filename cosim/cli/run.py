"""`cosim run`: a scenario from its JSON to results, figures and a table of KPIs."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile
from typing import TYPE_CHECKING

import click

from ..simulate import Observer

if TYPE_CHECKING:
    from ..results import Result
    from ..scenario import Assembly


@click.command()
@click.argument("scenario")
@click.option("--output-dir", type=click.Path(path_type=Path), help="Where results go; default: runs/NAME.")
@click.option("--stop-time", help="Stop time in s instead of the scenario's.")
@click.option("--step-size", help="Macro step in s instead of the scenario's.")
@click.option("--set", "settings", multiple=True, metavar="NAME=value", help="Set a variable, or /json/pointer=value anything.")
@click.option("--no-report", is_flag=True, help="Write no figures.")
def command(
    scenario: str,
    output_dir: Path | None,
    stop_time: str | None,
    step_size: str | None,
    settings: tuple[str, ...],
    no_report: bool,
) -> int:
    """Run SCENARIO, a JSON file or the name of a shipped scenario.

    Writes result.csv, kpis.json, run.json and figures to the output directory. Exit code 0: all is well; 1: a component
    failed, the results until then are kept; 2: the scenario was refused; 3: a check was not met.
    """
    from ..api import checks, execute, load
    from ..errors import CosimError
    from ..kpi import kpi_units
    from ..report.figures import draw_figures
    from ..report.tables import print_kpis
    from ..results.result import write_run
    from ..scenario.tree import parse_settings
    from . import messages

    messages.show()
    began = time.perf_counter()
    assembly = load(scenario, parse_settings(settings), stop_time=stop_time, step_size=step_size)
    directory = output_dir or Path("runs") / assembly.spec.name
    try:
        _prepare(directory, [spec.name for spec in assembly.spec.figures])
    except CosimError:
        assembly.free()  # from here on `simulate` frees the components
        raise
    try:
        with _progress(assembly) as observers:
            result = execute(assembly, observers)
        write_run(result, directory)
    except (CosimError, KeyboardInterrupt) as error:
        _keep(getattr(error, "result", None), directory)
        raise
    outcomes = checks(assembly, result)
    print_kpis(result.kpis, outcomes, kpi_units(assembly.kpis(), result.kpis))
    figures = [] if no_report else draw_figures(result, assembly.figures(), directory)
    _summary(result, directory, figures, began)
    return 0 if all(outcome.passed for outcome in outcomes) else 3


def _prepare(directory: Path, figures: Sequence[str]) -> None:
    """Make sure that results can be written before anything runs, and remove the figures of an earlier run."""
    from ..errors import InputError

    try:
        directory.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=directory):
            pass
        for name in figures:
            for suffix in (".png", ".svg", ".csv"):
                (directory / f"{name}{suffix}").unlink(missing_ok=True)
    except OSError as error:
        raise InputError(f'cannot write to "{directory}": {error.strerror or error}') from None


def _keep(partial: Result | None, directory: Path) -> None:
    """Write what was recorded before a failure."""
    from ..results.result import write_run

    if partial is not None and len(partial.time):
        write_run(partial, directory)
        click.echo(f"{len(partial.time)} rows until t = {partial.time[-1]:g} s kept in {directory}", err=True)


def _summary(result: Result, directory: Path, figures: list[Path], began: float) -> None:
    loop, simulated = result.timing["loop_seconds"], float(result.time[-1] - result.time[0])
    files = ", ".join(["result.csv", "kpis.json", "run.json", *(path.name for path in figures)])
    click.echo(f"\n{simulated:g} s simulated in {loop:.2f} s: {simulated / loop:.0f} times real time")
    click.echo(f"{files} in {directory} ({time.perf_counter() - began:.1f} s in all)")
    if by := result.metadata["terminated_by"]:
        click.echo(f"{by['component']} asked to end the simulation at t = {by['time']:g} s")


@contextmanager
def _progress(assembly: Assembly) -> Iterator[list[Observer]]:
    """A progress bar on a terminal, nothing elsewhere."""
    if not sys.stderr.isatty():
        yield []
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(assembly.spec.name)
        yield [lambda finished, total: progress.update(task, completed=finished, total=total)]
