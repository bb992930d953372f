"""Commands that run foreign code do it in a supervised child process."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import CosimError
from . import current_command_line, run_guarded
from .strict_sandbox import SANDBOX_KINDS

if TYPE_CHECKING:
    from ..core.recording import Recording
    from ..process.journal import Journal
    from ..process.supervisor import SupervisedOutcome

_isolation = click.option(
    "--isolation",
    type=click.Choice(["run", "fmu", "none"]),
    default="run",
    show_default=True,
    help="Run in a supervised child process, every FMU in one of its own, too, or in this process.",
)
_sandbox = click.option(
    "--sandbox",
    type=click.Choice(SANDBOX_KINDS),
    metavar="[strict]",
    help="Every FMU in a process of its own that reads only its own files, writes only to a temporary folder, has no network; "
    "with `strict` the whole command sees only the files it needs and writes only its results (needs bubblewrap).",
)


def supervision_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where foreign code runs: `isolation` and `sandbox`."""
    return _isolation(_sandbox(command))


def run_supervised_command(
    entry: Callable[[], int],
    isolation: str,
    save_partial: Callable[[SupervisedOutcome], None],
    while_running: Callable[[Journal], AbstractContextManager[object]] = nullcontext,
) -> int:
    """Run a command's work and return its exit code; when the child could not save its rows, `salvage` does. `beside` is what
    this process does while there is a child.

    Raises ComponentError for the component that was to blame, KeyboardInterrupt when the user ended the child.
    """
    from ..process.supervisor import can_supervise, run_supervised

    if isolation == "none" or not can_supervise():
        return entry()
    command_line = current_command_line()
    outcome = run_supervised(lambda: run_guarded(entry, command_line), while_running)
    if outcome.warning:
        click.echo(f"WARNING {outcome.warning}", err=True)
    folder = outcome.journal.folder
    if folder and folder.is_dir():
        _save_partial(outcome, save_partial, folder)
    if outcome.interrupted:
        raise KeyboardInterrupt
    if outcome.failure:
        raise outcome.failure
    return outcome.exit_code


def _save_partial(outcome: SupervisedOutcome, salvage: Callable[[SupervisedOutcome], None], folder: Path) -> None:
    """What the child has reported itself, such as a full disk, is not said again."""
    try:
        salvage(outcome)
    except CosimError as error:
        if outcome.failure or outcome.interrupted:
            click.echo(str(error), err=True)
    finally:
        rmtree(folder, ignore_errors=True)


def results_written(code: int) -> int:
    """All results are written and the outcome is certain: what components do from now on cannot change it."""
    from ..process.journal import EXIT_CODE, Phase, current_journal

    if journal := current_journal():
        journal[EXIT_CODE] = code
        journal.enter_phase(Phase.RESULTS_WRITTEN)
    return code


def set_deadlines(deadlines: Any) -> None:
    """Deadlines of a scenario for the supervisor."""
    from ..process.journal import Deadlines, current_journal

    if journal := current_journal():
        journal.deadlines = Deadlines(deadlines.load, deadlines.initialization, deadlines.step, deadlines.end)


def recover_outcome_recording(outcome: SupervisedOutcome) -> Recording:
    """What was recorded by a child that has come to a bad end."""
    from ..process.run_files.folder import recover_recording

    return recover_recording(outcome.journal.folder, outcome.row_count)
