"""Commands that run foreign code do it in a supervised child process."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from . import guarded

if TYPE_CHECKING:
    from ..recording import Recording
    from ..supervise import Outcome

option = click.option(
    "--isolation",
    type=click.Choice(["run", "none"]),
    default="run",
    show_default=True,
    help="Run in a supervised child process, or in this one.",
)


def protected(entry: Callable[[], int], isolation: str, salvage: Callable[[Outcome], None]) -> int:
    """Run a command's work and return its exit code; when foreign code ends the child, `salvage` saves what it has left.

    Raises ComponentError for the component that was to blame.
    """
    if isolation == "none":
        return entry()
    from ..supervise import supervised

    outcome = supervised(lambda: guarded(entry))
    if outcome.warning:
        click.echo(f"WARNING {outcome.warning}", err=True)
    folder = outcome.journal.folder
    if folder and folder.is_dir():  # the child could not finish what it began
        salvage(outcome)
    if outcome.failure:
        raise outcome.failure
    return outcome.code


def leaving(code: int) -> int:
    """All results are written and the outcome is certain: what components do from now on cannot change it."""
    from ..journal import CODE, Phase, current

    if journal := current():
        journal[CODE] = code
        journal.enter(Phase.LEAVING)
    return code


def configure(deadlines: Any) -> None:
    """Deadlines of a scenario for the supervisor."""
    from ..journal import Deadlines, current

    if journal := current():
        journal.deadlines = Deadlines(deadlines.load, deadlines.initialization, deadlines.step, deadlines.end)


def recovered(outcome: Outcome) -> Recording:
    """What was recorded by a child that has come to a bad end."""
    from ..unfinished import recover

    return recover(outcome.journal.folder, outcome.rows)
