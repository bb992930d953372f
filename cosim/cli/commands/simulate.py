"""`cosim simulate`: simulation of a single FMU."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ...core.integration_methods import METHODS
from ...core.paths import duplicate_descriptor
from ...core.text import count_noun
from ...process.output_lock import LOCK_FILE, LockKeeper, acquire_lock
from ...process.temporary_folders import temporary_run_folder
from .. import current_command_line, report_error, strict_sandbox, supervision
from ..messages import log_problems, print_json, print_line, print_log
from ..options import PATH, csv_option, json_option, path_option
from ..unfinished_runs import OutputFiles, writing_results

if TYPE_CHECKING:
    from ...components.fmi import Method
    from ...core.recording import Recording
    from ...process.supervisor import SupervisedOutcome


@click.command(cls=strict_sandbox.SandboxCommand)
@click.argument("fmu", type=PATH)
@path_option(
    "--output-file",
    help="CSV file for the outputs; default: print their final values.",
)
@click.option("--stop-time", help="Stop time (s); default: the FMU's, else 1 s after the start.")
@click.option(
    "--step-size",
    help="Communication step size (s); default: the FMU's, else a hundredth of the duration.",
)
@click.option(
    "--start-value",
    "start_values",
    multiple=True,
    metavar="name=value",
    help="Set a parameter or the start value of a variable.",
)
@path_option(
    "--input-file",
    help='CSV file with the column "time" and columns named like inputs.',
)
@click.option(
    "--solver",
    type=click.Choice(list(METHODS)),
    help=(
        "Simulate by Model Exchange with this method; default: by Co-Simulation if the FMU has it, "
        "else with cvode."
    ),
)
@click.option(
    "--solver-step-size",
    help=(
        "Largest step size (s) of a method with fixed step size; default: the FMU's, else "
        "--step-size."
    ),
)
@click.option(
    "--tolerance",
    type=click.FloatRange(0, min_open=True),
    help="Relative tolerance; default: the FMU's.",
)
@json_option(
    "an object with time (s) and the final values of the outputs by name; nothing with "
    "--output-file"
)
@csv_option
@supervision.supervision_options
def command(isolation: str, sandbox: str | None, output_file: Path | None, **options: Any) -> int:
    """Simulate a single FMU from its default start time.

    The FMU has Co-Simulation or Model Exchange of FMI 1.0, 2.0 or 3.0.
    """
    output = _Output.check(output_file) if output_file else None
    if strict_sandbox.must_rerun(sandbox):
        return strict_sandbox.rerun_in_bubblewrap(
            [path for path in (options["fmu"], options["input_file"]) if path],
            output and output.writable_folder,
        )
    with temporary_run_folder() as folder, LockKeeper() as locks:
        unfinished = Path(folder) / "run"
        if output and output.replaced:
            unfinished = OutputFiles.of_file(output.replaced).unfinished
        return supervision.run_supervised_command(
            lambda: _simulate(locks, unfinished, output, isolation, bool(sandbox), **options),
            isolation,
            lambda outcome: _save_after_crash(outcome, output),
        )


class _Output(NamedTuple):
    """Output file of the command.

    Attributes:
        shown: The path as messages show it.
        path: The same path, absolute; a duplicate in place of /dev/stdout, which a supervised
            process redirects.
        replaced: The file that is replaced, with symbolic links followed; None: a FIFO or a device
            is written to directly.
    """

    shown: Path
    path: Path
    replaced: Path | None

    @classmethod
    def check(cls, shown: Path) -> _Output:
        """Return the output, and raise an error if it cannot be written."""
        from ...results.files import check_output_file

        path = shown.absolute()
        replaced = check_output_file(path)
        return cls(shown, duplicate_descriptor(path), replaced)

    @property
    def writable_folder(self) -> Path | None:
        """Folder that the command must be able to write; None for a device."""
        if self.replaced:
            return self.replaced.parent
        return self.path.parent if self.path.is_fifo() else None


def _simulate(
    locks: LockKeeper,
    folder: Path,
    output: _Output | None,
    isolation: str,
    sandbox: bool,
    fmu: Path,
    stop_time: str | None,
    step_size: str | None,
    start_values: tuple[str, ...],
    input_file: Path | None,
    solver: Method | None,
    solver_step_size: str | None,
    tolerance: float | None,
    as_json: bool,
) -> int:
    from ...api.single_fmu import compile_fmu, parse_solver
    from ...components.fmi import InstanceSettings, Isolation
    from ...core.errors import InputError, Problem
    from ...engine.plan_run import simulating
    from ...engine.recorder import find_space_problems
    from ...process.run_files import keeping_run_files, remove_run_files, run_folder
    from ...results.checks import warn_non_finite
    from ...results.files import remove_files
    from ...results.result import describe_termination
    from ...scenario.settings import parse_settings

    print_log()
    values = parse_settings(start_values)
    settings = InstanceSettings(tolerance, parse_solver(solver, solver_step_size or None))
    fmu_isolation = Isolation(sandbox=sandbox) if sandbox or isolation == "fmu" else None
    times = stop_time or None, step_size or None
    plan, warnings = compile_fmu(fmu, *times, input_file, values, None, fmu_isolation, settings)
    log_problems(map(Problem, warnings))
    target = output.replaced if output else None
    if output and target:
        run_lock = target.parent / LOCK_FILE
        if run_lock.exists():  # the folder of a run, whose files are locked together
            acquire_lock(run_lock, output.shown.parent).release()  # refused while the run goes on
        locks.lock(OutputFiles.of_file(target).lock, output.shown)
        size = target.stat().st_size if target.is_file() else 0
        if problems := find_space_problems(plan, target.parent, csv=True, replaced=size):
            raise InputError(problems)
        remove_files(target.parent, target.name)
    with keeping_run_files(folder, writes_csv=target is not None), simulating(plan) as run:
        warn_non_finite(run.recording)
        if output:
            _write_recording(run.recording, output, run_folder())
            remove_run_files()
        if run.failure:
            return supervision.results_written(report_error(run.failure, current_command_line()))
        if not output:
            _print_final_values(run.recording, as_json)
        if run.termination:
            click.echo(describe_termination(run.termination.time, "the FMU"), err=True)
        return supervision.results_written(0)


def _save_after_crash(outcome: SupervisedOutcome, output: _Output | None) -> None:
    """Write the rows of a child process that crashed, was killed or was interrupted."""
    from ...process.run_files import recover_recording
    from ...results.checks import warn_non_finite

    print_log()
    recording = recover_recording(outcome.journal.folder, outcome.row_count)
    warn_non_finite(recording)
    _write_recording(recording, output, outcome.journal.folder)


def _write_recording(recording: Recording, output: _Output | None, unfinished: Path | None) -> None:
    """Write the CSV file; rows that cannot be written are kept beside it, if it is a file."""
    from ...results import Result

    if output and len(recording.time):
        result = Result(recording)
        with writing_results(result, unfinished if output.replaced else None, output.shown):
            result.to_csv(output.path)
        click.echo(f"{count_noun(len(recording.time), 'row')} in {output.shown}")


def _print_final_values(recording: Recording, as_json: bool) -> None:
    """Print the last row: numbers with six significant digits, as JSON with all digits."""
    time = recording.time.tolist()[-1]
    last = {name: values.tolist()[-1] for name, values in recording.columns.items()}
    if as_json:
        print_json({"time": time, "values": last})
        return
    click.echo(f"time = {time:.6g} s")
    for name, value in last.items():
        text = value.hex() if isinstance(value, bytes) else repr(value)
        if isinstance(value, float):
            text = f"{value:.6g}"
        unit = "" if recording.units[name] == "1" else recording.units[name]
        print_line(f"{name} = {text} {unit}".rstrip())
