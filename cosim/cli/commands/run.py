"""`cosim run`: a scenario from its JSON to results, figures and a table of KPIs."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import CosimError, InputError
from ...process.journal import STEP_COUNT
from .. import current_command_line, live, report_error, strict_sandbox, supervision
from ..progress import progress_bar

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from ...api import Execution
    from ...engine.run_loop import Observer
    from ...process.supervisor import SupervisedOutcome
    from ...results import Result
    from ...results.checks import CheckOutcome
    from ...scenario import PreparedRun

_LATENESS_LABELS = {"max": "max_lateness", "mean": "mean_lateness", "99 %": "lateness_99_percent"}

#: folder of a run that is going on, inside its output directory
UNFINISHED_FOLDER = ".unfinished"

RESULT_FILES = ("result.csv", "result.parquet", "result.mcap", "kpis.json", "run.json", "report.html", "replay.html")


@click.command(cls=strict_sandbox.SandboxCommand)
@click.argument("scenario")
@click.option("--output-dir", type=click.Path(path_type=Path), help="Where results go; default: runs/NAME.")
@click.option("--stop-time", help="Stop time in s instead of the scenario's.")
@click.option("--step-size", help="Macro step in s instead of the scenario's.")
@click.option("--set", "settings", multiple=True, metavar="NAME=value", help="Set a variable, or /json/pointer=value anything.")
@click.option(
    "--real-time",
    type=click.FloatRange(min=0, min_open=True),
    is_flag=False,
    flag_value=1.0,
    metavar="[FACTOR]",
    help="Keep pace with the clock, FACTOR simulated seconds per second (1 when left out).",
)
@click.option(
    "--late",
    type=click.Choice(["warn", "fail"]),
    default="warn",
    show_default=True,
    help="What happens when a real-time run falls more than one step behind.",
)
@click.option("--parquet", is_flag=True, help="Write result.parquet too (extra `parquet`).")
@click.option("--mcap", is_flag=True, help="Write result.mcap too, for Foxglove and ROS 2 (extra `mcap`).")
@click.option("--no-report", is_flag=True, help="Write no figures and no report.html.")
@live.view_options
@supervision.supervision_options
def command(isolation: str, sandbox: str | None, view: bool, view_port: int, **options: Any) -> int:
    """Run SCENARIO, a JSON file or the name of a shipped scenario.

    Writes result.csv, kpis.json, run.json, figures and report.html to the output directory. Exit code 0: all is well;
    1: a component failed, the results until then are kept; 2: the scenario was refused; 3: a check was not met.
    """
    if view:
        live.check_view_options(isolation, sandbox, options["late"])
    if strict_sandbox.must_rerun(sandbox):
        return strict_sandbox.rerun_in_bubblewrap(*_sandbox_paths(**options))
    apart: dict[str, Any] = {"isolation": "fmu" if isolation == "fmu" else "none", "sandbox": bool(sandbox)}
    if view:
        return live.run_with_view(
            lambda link: _run_scenario(**options, **apart, link=link), isolation, _save_after_crash, view_port
        )
    return supervision.run_supervised_command(lambda: _run_scenario(**options, **apart), isolation, _save_after_crash)


def _sandbox_paths(scenario: str, output_dir: Path | None, settings: Sequence[str], **_: Any) -> tuple[list[Path], Path | None]:
    """Files that the command reads, and the folder it writes to (None when it will refuse the scenario)."""
    from ...scenario import load_scenario
    from ...scenario.nested_systems import parse_settings

    loaded = load_scenario(scenario, parse_settings(settings))
    return loaded.files(), None if loaded.problems else (output_dir or Path("runs") / loaded.spec.name).absolute()


def _run_scenario(
    scenario: str,
    output_dir: Path | None,
    stop_time: str | None,
    step_size: str | None,
    settings: tuple[str, ...],
    no_report: bool,
    parquet: bool,
    mcap: bool,
    link: Connection | None = None,
    **conditions: Any,
) -> int:
    from ...api import executing, load
    from ...process.run_files.folder import keeping_run_files
    from ...results.mcap_files import require_mcap
    from ...results.parquet_files import require_parquet
    from ...scenario.nested_systems import parse_settings
    from ...scenario.plausibility import missing_connections
    from .. import messages

    warnings = messages.print_log()
    if parquet:
        require_parquet()
    if mcap:
        require_mcap()
    began = time.perf_counter()
    assembly = load(scenario, parse_settings(settings), stop_time=stop_time, step_size=step_size, **conditions)
    supervision.set_deadlines(assembly.spec.deadlines)
    messages.log_problems(missing_connections(assembly))
    directory = (output_dir or Path("runs") / assembly.spec.name).absolute()
    shown = output_dir or Path("runs") / assembly.spec.name
    _warn_overwriting(directory, shown, assembly.document.file.resolve())
    try:
        if not no_report and (problems := assembly.figure_problems()):
            raise InputError(problems)
        _prepare_folder(directory, [spec.name for spec in assembly.spec.figures])
        control = live.create_control(assembly, link) if link else None
    except CosimError:
        assembly.free()  # from here on `executed` frees the components
        raise
    with (
        keeping_run_files(directory / UNFINISHED_FOLDER, directory / "result.csv"),
        _progress_observers(assembly) as observers,
        executing(live.with_control(assembly, control), observers) as execution,
    ):
        execution.result.metadata["warnings"] = warnings
        if control:
            execution.result.metadata["live_events"] = control.finish()
        code = _write_outcome(execution, assembly, directory, shown, no_report, began)
        if parquet:
            execution.result.to_parquet(directory / "result.parquet")
        if mcap:
            from ...report.scene import build_scene

            execution.result.to_mcap(directory / "result.mcap", build_scene(execution.result.metadata))
        return supervision.results_written(code)


def _write_outcome(
    execution: Execution, assembly: PreparedRun, directory: Path, shown: Path, no_report: bool, began: float
) -> int:
    """Write, print and draw what came of the run; returns the exit code."""
    from ...api import evaluate_scenario_checks
    from ...process.run_files.folder import remove_run_files
    from ...report.tables import print_kpis
    from ...results.kpi import kpi_units
    from ...results.result import write_run

    result = execution.result
    if execution.failure:
        _write_partial_result(result, directory, shown)
        remove_run_files()
        return report_error(execution.failure, current_command_line())
    write_run(result, directory)
    remove_run_files()
    outcomes = evaluate_scenario_checks(assembly, result)
    print_kpis(result.kpis, outcomes, kpi_units(assembly.kpis(), result.kpis, result.units))
    files = [] if no_report else _write_figures_and_report(result, assembly, outcomes, directory)
    _print_summary(result, shown, files, began)
    return 0 if all(outcome.passed for outcome in outcomes) else 3


def _write_figures_and_report(
    result: Result, assembly: PreparedRun, outcomes: Sequence[CheckOutcome], directory: Path
) -> list[str]:
    """Draw the figures and write the report; returns the names of the files."""
    from ...report.figures import draw_figure, figure_to_svg, save_figure
    from ...report.run_page import write_report

    pictures = {}
    for name, function, arguments in assembly.figures():
        figure = draw_figure(result, name, function, arguments)
        save_figure(figure, directory / f"{name}.png")
        pictures[name] = figure_to_svg(figure)
    write_report(result, outcomes, pictures, directory / "report.html")
    return [*(f"{name}.png" for name in pictures), "report.html"]


def _save_after_crash(outcome: SupervisedOutcome) -> None:
    """Write what a child has left that came to a bad end."""
    from ...process.run_files.folder import read_metadata
    from ...results import Result

    folder = outcome.journal.folder
    if folder is not None:
        failure = "interrupted" if outcome.interrupted else str(outcome.failure)
        metadata = {**read_metadata(folder), "macro_steps": outcome.journal[STEP_COUNT], "failure": failure}
        _write_partial_result(
            Result(supervision.recover_outcome_recording(outcome), metadata=metadata), folder.parent, folder.parent
        )


def _prepare_folder(directory: Path, figures: Sequence[str]) -> None:
    """Make sure that results can be written before anything runs, and remove those of an earlier run."""
    from ...results.files import check_writable, remove_files

    check_writable(directory)
    remove_files(directory, *RESULT_FILES, *(f"{name}{suffix}" for name in figures for suffix in (".png", ".svg", ".csv")))


def _warn_overwriting(directory: Path, shown: Path, file: Path) -> None:
    """A copied scenario whose name was not changed takes the folder of the first one."""
    try:
        former = json.loads((directory / "run.json").read_text(encoding="utf-8"))["scenario_file"]
    except (OSError, ValueError, LookupError, TypeError):  # there are none, or they say nothing of it
        return
    if former != str(file):
        text = f'replaces the results of {former} in {shown}; another "name" in the scenario or --output-dir keeps both'
        click.echo(text, err=True)


def _write_partial_result(partial: Result, directory: Path, shown: Path) -> None:
    """Write what was recorded before a failure."""
    from ...results.result import write_run

    if len(partial.time):
        write_run(partial, directory)
        click.echo(f"{len(partial.time)} rows until t = {partial.time[-1]:g} s kept in {shown}", err=True)


def _print_summary(result: Result, directory: Path, drawn: list[str], began: float) -> None:
    loop, simulated = result.timing["loop_seconds"], float(result.time[-1] - result.time[0])
    files = ", ".join(["result.csv", "kpis.json", "run.json", *drawn])
    click.echo(f"\n{simulated:g} s simulated in {loop:.2f} s: {simulated / loop:.0f} times real time")
    click.echo(f"{files} in {directory} ({time.perf_counter() - began:.1f} s in all)")
    if pace := result.metadata["real_time"]:
        click.echo(_format_pacing(pace))
    if events := result.metadata.get("live_events"):
        click.echo(f"values were set {len(events)} times while it ran: run.json has them as events that repeat this run")
    if by := result.metadata["terminated_by"]:
        click.echo(f"{by['component']} asked to end the simulation at t = {by['time']:g} s")


def _format_pacing(pace: Mapping[str, Any]) -> str:
    lateness = ", ".join(f"{label} {1e3 * pace[key]:.3g} ms" for label, key in _LATENESS_LABELS.items())
    return f"paced to {pace['factor']:g} times real time: {pace['late_steps']} of {pace['steps']} steps late; lateness {lateness}"


@contextmanager
def _progress_observers(assembly: PreparedRun) -> Iterator[list[Observer]]:
    with progress_bar(assembly.spec.name) as observer:
        yield [observer] if observer else []
