"""Messages of commands: log of components, warnings, JSON, outcomes and progress."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click

from ..core.errors import Problem
from ..core.json_values import parse_object
from ..core.text import SPACES, escape_control_characters
from ..process.standard_streams import unescaped
from . import current_command_line

if TYPE_CHECKING:
    from ..studies.regression import RegressionOutcome

#: lowest level of printed messages, by `CommandLine.verbosity`
_LEVELS = {-1: logging.WARNING, 0: logging.INFO, 1: logging.DEBUG}
#: number of warnings collected for the report
MAX_WARNINGS = 200


class _LogPrinter(logging.StreamHandler[TextIO]):
    """Handler that prints messages to standard error."""

    def __init__(self) -> None:
        super().__init__(sys.stderr)
        self.setFormatter(logging.Formatter("%(levelname)s %(message)s"))


class _WarningCollector(logging.Handler):
    """Handler that collects the texts of warnings and errors."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Collect a message; the last one says that more were only printed."""
        if len(self.texts) < MAX_WARNINGS:
            self.texts.append(f"{record.levelname} {record.getMessage()}")
        elif len(self.texts) == MAX_WARNINGS:
            self.texts.append("more warnings were printed and are not listed here")


def print_log() -> list[str]:
    """Print the following messages of the logger "cosim" as --quiet or --verbose demand.

    Returns:
        The list that collects the texts of warnings and errors.
    """
    texts = collect_log()
    logger = logging.getLogger("cosim")
    logger.addHandler(_LogPrinter())
    logger.setLevel(_LEVELS[current_command_line().verbosity])
    return texts


def collect_log() -> list[str]:
    """Collect the following warnings and errors of the logger "cosim", and print none of them.

    The handlers of a program that calls a command stay.

    Returns:
        The list that collects their texts.
    """
    logger, collector = logging.getLogger("cosim"), _WarningCollector()
    for handler in logger.handlers[:]:
        if isinstance(handler, _LogPrinter | _WarningCollector):  # of an earlier command
            logger.removeHandler(handler)
    logger.addHandler(collector)
    return collector.texts


def print_line(text: str) -> None:
    """Print a text that may contain foreign text as one line of standard output.

    Line breaks in it are escaped.
    """
    click.echo(escape_control_characters(text, keep=SPACES))


def print_json(value: Any) -> None:
    """Print a value as JSON; NumPy values become numbers, and NaN and infinity become null."""
    from ..results.files import to_json_types

    click.echo(
        json.dumps(to_json_types(value), indent=2, ensure_ascii=False),
        file=current_command_line().data,
    )


def print_outcome(outcome: RegressionOutcome) -> None:
    """Print a line about a scenario and its problems; with --quiet, print only the problems."""
    if outcome.code and current_command_line().verbosity < 0:
        for line in outcome.details:
            click.echo(f"{outcome.name}: {line}", err=True)
    word = click.style("passed", fg="green")
    if outcome.code:
        word = click.style("FAILED", fg="red", bold=True)
    click.echo(word, nl=False, file=unescaped(sys.stdout))
    click.echo(f"  {outcome.name:<28} {outcome.summary:<24} {outcome.seconds:5.1f} s")
    for line in outcome.details:
        click.echo(f"        {line}")


def log_problems(problems: Iterable[Problem]) -> None:
    """Log problems that do not prevent a run as warnings."""
    for problem in problems:
        logging.getLogger("cosim").warning("%s", problem)


def warn_overwriting(folder: Path, about: str, kind: str, file: Path) -> None:
    """Warn if results of another file with the same name are replaced in a folder.

    Args:
        folder: The output directory.
        about: Name of the JSON file that describes the earlier results.
        kind: "scenario" or "sweep"; the JSON file names its file as "scenario_file" or
            "sweep_file".
        file: The file whose results are written now.
    """
    try:
        former = parse_object((folder / about).read_text(encoding="utf-8"))[f"{kind}_file"]
    except (OSError, ValueError, LookupError):  # no earlier results, or an unreadable file
        return
    if former != str(file):
        text = (
            f'replaces the results of {former} in {folder}; another "name" in the {kind} or '
            "--output-dir keeps both"
        )
        click.echo(text, err=True)


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[[int, int], None] | None]:
    """Show a progress bar and yield the function that updates it with (finished, total).

    None without a terminal.
    """
    if not sys.stderr.isatty() or current_command_line().verbosity < 0:
        yield None
        return
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    from ..report.tables import cell_text

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
    )
    with Progress(
        *columns, console=Console(file=unescaped(sys.stderr)), transient=True
    ) as progress:
        task = progress.add_task(cell_text(description))
        yield lambda finished, total: progress.update(task, completed=finished, total=total)
