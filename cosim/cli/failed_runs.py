"""Results and report of a run of `cosim run` that failed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..core.errors import CosimError
from ..core.text import count_noun
from ..process.journal import STEP_COUNT
from . import supervision
from .messages import print_json, print_log
from .run_summary import summarize_run
from .unfinished_runs import writing_results

if TYPE_CHECKING:
    from ..process.supervisor import SupervisedOutcome
    from ..results import Result
    from .run_outputs import RunOptions


def write_partial_result(
    partial: Result, folder: Path, shown_folder: Path, unfinished: Path | None
) -> None:
    """Write the rows recorded before a failure, if there are any; see `writing_results`."""
    from ..results.result import write_run

    if len(partial.time):
        with writing_results(partial, unfinished, shown_folder):
            write_run(partial, folder)
        rows = count_noun(len(partial.time), "row")
        click.echo(f"{rows} until t = {partial.time[-1]:g} s kept in {shown_folder}", err=True)


def report_failed_run(partial: Result, folder: Path, options: RunOptions, exit_code: int) -> int:
    """Write the report of a run that failed, and print its summary for --json.

    Args:
        partial: what was recorded until the failure, already written.
        folder: the output directory.
        options: options of the command.
        exit_code: exit code of the command.

    Returns:
        The exit code.
    """
    from ..report.finished_run import write_folder_report

    files = ["result.csv", "run.json"] if len(partial.time) else []
    if files and not options.no_report:
        try:
            write_folder_report(folder, folder / "report.html")
            files.append("report.html")
        except CosimError as error:
            click.echo(f"no report: {error}", err=True)
    if options.as_json:
        print_json(summarize_run(partial, (), folder, files, exit_code))
    return exit_code


def save_after_crash(outcome: SupervisedOutcome, options: RunOptions) -> None:
    """Write the rows of a child process that crashed, was killed or was interrupted.

    A crash also has a report.

    The report is written by another supervised process, because it calls functions of the user.
    """
    from ..process.run_files import read_metadata
    from ..results import Result
    from ..results.non_finite import warn_non_finite

    folder = outcome.journal.folder
    if folder is not None:
        failure = "interrupted" if outcome.interrupted else str(outcome.failure)
        metadata = {
            **read_metadata(folder),
            "macro_steps": outcome.journal[STEP_COUNT],
            "failure": failure,
        }
        recording = supervision.recover_outcome_recording(outcome)
        if metadata.get("scenario", {}).get("non_finite") != "allow":
            print_log()
            metadata["non_finite"] = warn_non_finite(recording)
        partial = Result(recording, metadata=metadata)
        write_partial_result(partial, folder.parent, folder.parent, folder)
        if outcome.failure:
            code = outcome.failure.exit_code
            supervision.run_supervised_command(
                lambda: report_failed_run(partial, folder.parent, options, code),
                "run",
                lambda _outcome: None,
            )
