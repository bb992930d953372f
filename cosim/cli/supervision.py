"""Execution of a command in a supervised child process."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from shutil import rmtree
from typing import TYPE_CHECKING

import click

from ..core.errors import CosimError
from . import current_command_line, run_guarded
from .options import options
from .strict_sandbox import SANDBOX_KINDS

if TYPE_CHECKING:
    from ..process.journal import Journal
    from ..process.supervisor import SupervisedOutcome

supervision_options = options(
    click.option(
        "--isolation",
        type=click.Choice(["run", "fmu", "none"]),
        default="run",
        show_default=True,
        help=(
            "run: in a supervised child process; fmu: also each FMU in its own process; none: in "
            "this process."
        ),
    ),
    click.option(
        "--sandbox",
        type=click.Choice(SANDBOX_KINDS),
        metavar="[strict]",
        help=(
            "Run each FMU in its own process that reads only its own files, writes only to a "
            "temporary folder, has no network and starts no programs. strict: also confine the "
            "whole command to the files it needs and to its output directory (requires bubblewrap)."
        ),
    ),
)


def run_supervised_command(
    entry: Callable[[], int],
    isolation: str = "run",
    save_partial: Callable[[SupervisedOutcome], None] | None = None,
    while_running: Callable[[Journal], AbstractContextManager[object]] = nullcontext,
) -> int:
    """Run a command in a supervised child process and return its exit code.

    Args:
        entry: the command's work; returns the exit code.
        isolation: value of `--isolation`; with "none", `entry` is called in this process.
        save_partial: called if the child left files of an unfinished run, to save the rows recorded
            until then; the files stay if it raises an error.
        while_running: context of this process while the child runs.

    Raises:
        ComponentError: if the child crashed or exceeded a deadline; names the responsible
            component.
        KeyboardInterrupt: if the user interrupted the child.
    """
    from ..process.run_files import find_kept_rows
    from ..process.supervisor import can_supervise, run_supervised

    if isolation == "none" or not can_supervise():
        return entry()
    command_line = current_command_line()
    outcome = run_supervised(lambda: run_guarded(entry, command_line), while_running)
    if outcome.warning:
        click.echo(f"WARNING {outcome.warning}", err=True)
    folder = outcome.journal.folder
    # a child that has kept the rows has said so
    if folder and folder.is_dir() and (outcome.failure or not find_kept_rows(folder)):
        try:
            if save_partial:
                save_partial(outcome)
        except CosimError as error:
            click.echo(str(error), err=True)
        else:
            rmtree(folder, ignore_errors=True)
    if outcome.interrupted:
        raise KeyboardInterrupt
    if outcome.failure:
        raise outcome.failure
    return outcome.exit_code


def results_written(code: int) -> int:
    """Record the final exit code in the journal and return it.

    Later failures do not change it.
    """
    from ..process.journal import EXIT_CODE, Phase, current_journal

    if journal := current_journal():
        journal[EXIT_CODE] = code
        journal.enter_phase(Phase.RESULTS_WRITTEN)
    return code
