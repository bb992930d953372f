"""Common parts of `cosim sweep` and `cosim tune`.

Options, run store, runner, progress and tables.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..core.resources import available_processors
from ..core.size_limits import MAX_RUNS
from ..core.text import count_noun
from . import current_command_line
from .options import csv_option, flag_option, options

if TYPE_CHECKING:
    from ..studies.execution.job import Record
    from ..studies.execution.run_store import RunStore
    from ..studies.study import CheckingRunner, Study

#: time between two lines of progress without a terminal (s)
_LINE_INTERVAL = 30.0

#: options that sweeps and tunings share
study_options = options(
    click.option(
        "--workers",
        type=click.IntRange(min=1),
        help="Number of runs at a time on this machine; default: one per processor.",
    ),
    click.option(
        "--scheduler",
        metavar="tcp://HOST:PORT",
        help=(
            "Run on the Dask cluster with this scheduler (extra `cluster`). Only for a cluster "
            "that you trust: Dask unpickles its answers, so that it can run code here as you run "
            "code there."
        ),
    ),
    click.option(
        "--max-runs",
        type=click.IntRange(min=1),
        default=MAX_RUNS,
        show_default=True,
        help="Refuse a study of more runs.",
    ),
    flag_option("--retry-failed", help="Repeat the runs that failed in an earlier call."),
    csv_option,
)


def open_run_store(folder: Path, retry: bool) -> RunStore:
    """Open the store of finished runs in a folder and report how many of its lines are unreadable.

    Args:
        folder: the output directory.
        retry: treat failed runs as not finished.

    Raises:
        InputError: if the folder cannot be used.
    """
    from ..studies.execution.run_store import RunStore

    run_store = RunStore(folder, retry)
    if count := run_store.unreadable_lines:
        click.echo(
            (
                f"{run_store.path}: {count_noun(count, 'unreadable line')}; the missing runs are "
                "repeated"
            ),
            err=True,
        )
    return run_store


def create_runner(study: Study, workers: int | None, scheduler: str | None) -> CheckingRunner:
    """Return the runner for the options `--workers` and `--scheduler`."""
    if scheduler is None:
        from ..studies.execution.worker_pool import LocalRunner

        return LocalRunner(study.context, workers or available_processors())
    if workers is not None:
        raise click.UsageError(
            "--workers is the number of processes on this machine; it cannot be combined with "
            "--scheduler"
        )
    from ..studies.cluster import ClusterRunner

    return ClusterRunner(study, scheduler)


class StudyProgress:
    """Counter of finished runs that shows their number, rate and remaining time."""

    def __init__(self, total: int, earlier: int, show: Callable[[str, int], object]):
        """Start to count.

        Args:
            total: number of runs of the study.
            earlier: number of runs that an earlier call has finished.
            show: called with a text and the number of finished runs.
        """
        self._total, self._earlier, self._show = total, earlier, show
        self._began = time.monotonic()
        self.finished = self.failed = 0

    def __call__(self, record: Record) -> None:
        """Count a finished run and show the progress."""
        self.finished += 1
        self.failed += bool(record.failure)
        self._show(self.text(time.monotonic() - self._began), self._earlier + self.finished)

    def text(self, seconds: float) -> str:
        """Return the progress, such as "120 of 1000 runs, 3 failed, 7.5 per second, 2 min left"."""
        done = self._earlier + self.finished
        rate = self.finished / max(seconds, 1e-9)
        left = format_duration((self._total - done) / rate) if rate else "?"
        failed = f", {self.failed} failed" if self.failed else ""
        return (
            f"{done} of {count_noun(self._total, 'run')}{failed}, {rate:.3g} per second, {left} "
            "left"
        )


def format_duration(seconds: float) -> str:
    """Return a duration such as "45 s", "12 min" or "3.5 h"."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


@contextmanager
def running_study(
    study: Study, total: int, workers: int | None, scheduler: str | None, earlier: int = 0
) -> Iterator[tuple[CheckingRunner, StudyProgress]]:
    """Yield the runner of a study and its progress; a termination signal is an interrupt.

    Args:
        study: The study.
        total: The number of its runs.
        workers: The option `--workers`.
        scheduler: The option `--scheduler`.
        earlier: The number of runs that an earlier call has finished.
    """
    from ..process.supervisor import interrupt_on_termination

    with (
        interrupt_on_termination(),
        show_progress(total) as show,
        create_runner(study, workers, scheduler) as runner,
    ):
        yield runner, StudyProgress(total, earlier, show)


@contextmanager
def show_progress(total: int) -> Iterator[Callable[[str, int], object]]:
    """Show the progress of `total` runs: as a bar on a terminal, else as lines."""
    if current_command_line().verbosity < 0:
        yield lambda _text, _done: None
        return
    if not sys.stderr.isatty():
        shown = time.monotonic()

        def print_text(text: str, _done: int) -> None:
            nonlocal shown
            if time.monotonic() - shown > _LINE_INTERVAL:
                shown = time.monotonic()
                click.echo(text, err=True)

        yield print_text
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    from ..process.standard_streams import unescaped

    with Bar(
        BarColumn(),
        TextColumn("{task.description}"),
        console=Console(file=unescaped(sys.stderr)),
        transient=True,
    ) as bar:
        task = bar.add_task("", total=total)
        yield lambda text, done: bar.update(task, completed=done, description=text)
