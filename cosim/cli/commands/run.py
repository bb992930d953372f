"""`cosim run`: a scenario from its JSON to results, figures and a table of KPIs."""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from ...core.errors import InputError, Problem
from ...process.output_lock import LockKeeper
from .. import live, strict_sandbox, supervision
from ..messages import log_problems, print_log, progress_bar, warn_overwriting
from ..options import csv_option, flag_option, json_option, output_dir_option, scenario_argument
from ..run_outputs import RunOptions, RunOutcome, save_after_crash, write_outputs
from ..unfinished_runs import OutputFiles

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

    from ...api import Simulation
    from ...scenario import PreparedRun

RESULT_FILES = (
    "result.csv",
    "result.parquet",
    "result.mcap",
    "kpis.json",
    "run.json",
    "report.html",
    "replay.html",
    "tubes.png",
)


@click.command(cls=strict_sandbox.SandboxCommand)
@scenario_argument
@output_dir_option
@click.option("--stop-time", help="Stop time (s), instead of the scenario's.")
@click.option("--step-size", help="Macro step size (s), instead of the scenario's.")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=value",
    help="Set a variable; /json/pointer=value changes any value of the scenario.",
)
@click.option(
    "--real-time",
    type=click.FloatRange(min=0, min_open=True),
    is_flag=False,
    flag_value=1.0,
    metavar="[FACTOR]",
    help="Simulate FACTOR seconds per second of wall time; FACTOR defaults to 1.",
)
@click.option(
    "--late",
    type=click.Choice(["warn", "fail"]),
    default="warn",
    show_default=True,
    help="Reaction to a real-time run that is more than one step late.",
)
@flag_option("--parquet", help="Also write result.parquet (extra `parquet`).")
@flag_option("--mcap", help="Also write result.mcap, for Foxglove and ROS 2 (extra `mcap`).")
@flag_option("--no-report", help="Write neither figures nor report.html.")
@json_option(
    "an object with name, exit_code, failure, termination, start_time and end_time (s), "
    "loop_seconds, kpis, checks, warnings, "
    "folder and files"
)
@csv_option
@live.view_options
@supervision.supervision_options
def command(
    isolation: str, sandbox: str | None, view: bool, wait: bool, view_port: int, **options: Any
) -> int:
    """Run SCENARIO and write results, figures and a report.

    SCENARIO is a JSON file or the name of a shipped scenario. Writes result.csv, kpis.json,
    run.json, figures and report.html to the output directory. Exit code 0: the run ended and all
    checks passed; 1: a component failed, the results until then are kept; 2: the scenario was
    refused; 3: a check failed, or a condition with the outcome "crash" ended the run.
    """
    run_options = RunOptions(
        **options, isolation="fmu" if isolation == "fmu" else "none", sandbox=bool(sandbox)
    )
    if wait and not view:
        raise click.UsageError("--wait requires --view")
    if view:
        live.check_view_options(isolation, sandbox, run_options.late)
    if strict_sandbox.must_rerun(sandbox):
        from ...scenario import load_scenario
        from ...scenario.settings import parse_settings

        loaded = load_scenario(run_options.scenario, parse_settings(run_options.settings))
        output = None
        if not loaded.problems:
            output = run_options.output_folder(loaded.spec.name).absolute()
        return strict_sandbox.rerun_in_bubblewrap(loaded.files(), output)
    save = partial(save_after_crash, options=run_options)
    with LockKeeper() as locks:
        if view:
            return live.run_with_view(
                lambda link: _run_scenario(run_options, locks, link),
                isolation,
                save,
                view_port,
                wait=wait,
            )
        return supervision.run_supervised_command(
            lambda: _run_scenario(run_options, locks), isolation, save
        )


def _run_scenario(options: RunOptions, locks: LockKeeper, link: Connection | None = None) -> int:
    """Run the scenario in this process, write its outputs and return the exit code.

    Args:
        options: options of the command.
        locks: keeper of the lock of the output directory.
        link: connection to a live view; None: no live view.
    """
    from ...process.float_mode import default_float_mode
    from ...process.run_files import keeping_run_files

    warnings = print_log()
    if options.parquet:
        from ...results.parquet_files import require_parquet

        require_parquet()
    if options.mcap:
        from ...results.mcap_files import require_mcap

        require_mcap()
    began = time.perf_counter()
    with _load(options, None if link else options.real_time) as simulation:
        prepared = simulation.prepared
        folder = options.output_folder(prepared.spec.name).absolute()
        _prepare_folder(prepared, options, locks)
        control = live.create_control(prepared, link, options.real_time) if link else None
        with (
            keeping_run_files(
                OutputFiles.of_folder(folder).unfinished, prepared.metadata, writes_csv=True
            ),
            progress_bar(prepared.spec.name) as progress,
            default_float_mode(),
            simulation,
        ):
            result = simulation.execute([progress] if progress else [], control)
            result.metadata["warnings"] = warnings
            if control:
                result.metadata["live_events"] = control.finish()
            return supervision.results_written(
                write_outputs(RunOutcome(options, prepared, result, began))
            )


def _load(options: RunOptions, real_time: float | None) -> Simulation:
    """Load the scenario and print warnings about it."""
    from ...api import load
    from ...scenario.plausibility import find_run_warnings
    from ...scenario.settings import parse_settings

    simulation = load(
        options.scenario,
        parse_settings(options.settings),
        stop_time=options.stop_time,
        step_size=options.step_size,
        real_time=real_time,
        late=options.late,
        isolation=options.isolation,
        sandbox=options.sandbox,
    )
    log_problems(find_run_warnings(simulation.prepared))
    return simulation


def _prepare_folder(prepared: PreparedRun, options: RunOptions, locks: LockKeeper) -> None:
    """Prepare the output directory: check and lock it, and remove results of an earlier run.

    Also check the figures.
    """
    from ...engine.recorder import find_space_problems
    from ...results.files import check_writable, remove_files

    if not options.no_report and (problems := prepared.figure_problems()):
        raise InputError(problems)
    shown = options.output_folder(prepared.spec.name)
    folder = shown.absolute()
    check_writable(folder)
    locks.lock(OutputFiles.of_folder(folder).lock, shown)
    warn_overwriting(shown, "run.json", "scenario", prepared.document.file.resolve())
    former = [folder / name for name in RESULT_FILES]
    replaced = sum(file.stat().st_size for file in former if file.is_file())
    if problems := find_space_problems(prepared.plan, folder, csv=True, replaced=replaced):
        where = prepared.root.where
        raise InputError([Problem(each.message, where(*each.subject)) for each in problems])
    remove_files(folder, *RESULT_FILES)
    for figure in prepared.spec.figures:
        remove_files(folder, *(f"{figure.name}{suffix}" for suffix in (".png", ".svg", ".csv")))
