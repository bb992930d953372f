"""Commands that run foreign code do it in a supervised child process."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any

import click

from ..core.errors import CosimError
from . import guarded
from .strict_sandbox import KINDS

if TYPE_CHECKING:
    from ..core.recording import Recording
    from ..process.journal import Journal
    from ..process.supervisor import Outcome

_isolation = click.option(
    "--isolation",
    type=click.Choice(["run", "fmu", "none"]),
    default="run",
    show_default=True,
    help="Run in a supervised child process, every FMU in one of its own, too, or in this process.",
)
_sandbox = click.option(
    "--sandbox",
    type=click.Choice(KINDS),
    metavar="[strict]",
    help="Every FMU in a process of its own that reads only its own files, writes only to a temporary folder, has no network; "
    "with `strict` the whole command sees only the files it needs and writes only its results (needs bubblewrap).",
)


def option(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where foreign code runs: `isolation` and `sandbox`."""
    return _isolation(_sandbox(command))


def protected(
    entry: Callable[[], int],
    isolation: str,
    salvage: Callable[[Outcome], None],
    beside: Callable[[Journal], AbstractContextManager[object]] = nullcontext,
) -> int:
    """Run a command's work and return its exit code; when the child could not save its rows, `salvage` does. `beside` is what
    this process does while there is a child.

    Raises ComponentError for the component that was to blame, KeyboardInterrupt when the user ended the child.
    """
    from ..process.supervisor import possible, supervised

    if isolation == "none" or not possible():
        return entry()
    outcome = supervised(lambda: guarded(entry), beside)
    if outcome.warning:
        click.echo(f"WARNING {outcome.warning}", err=True)
    folder = outcome.journal.folder
    if folder and folder.is_dir():
        _salvage(outcome, salvage, folder)
    if outcome.interrupted:
        raise KeyboardInterrupt
    if outcome.failure:
        raise outcome.failure
    return outcome.code


def _salvage(outcome: Outcome, salvage: Callable[[Outcome], None], folder: Path) -> None:
    """What the child has reported itself, such as a full disk, is not said again."""
    try:
        salvage(outcome)
    except CosimError as error:
        if outcome.failure or outcome.interrupted:
            click.echo(str(error), err=True)
    finally:
        rmtree(folder, ignore_errors=True)


def leaving(code: int) -> int:
    """All results are written and the outcome is certain: what components do from now on cannot change it."""
    from ..process.journal import CODE, Phase, current

    if journal := current():
        journal[CODE] = code
        journal.enter(Phase.LEAVING)
    return code


def configure(deadlines: Any) -> None:
    """Deadlines of a scenario for the supervisor."""
    from ..process.journal import Deadlines, current

    if journal := current():
        journal.deadlines = Deadlines(deadlines.load, deadlines.initialization, deadlines.step, deadlines.end)


def recovered(outcome: Outcome) -> Recording:
    """What was recorded by a child that has come to a bad end."""
    from ..process.run_files.folder import recover

    return recover(outcome.journal.folder, outcome.rows)
