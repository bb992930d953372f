"""What `cosim sweep` and `cosim tune` have in common: engines and progress."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..core.processors import available_processors

if TYPE_CHECKING:
    from ..studies.execution.job import Record
    from ..studies.execution.run_store import RunStore
    from ..studies.study import CheckingRunner, Study

#: without a terminal a line of progress is printed so often (s)
_LINE_INTERVAL = 30.0

_workers = click.option(
    "--workers", type=click.IntRange(min=1), help="Runs at a time on this machine; default: one per processor."
)
_scheduler = click.option(
    "--scheduler", metavar="tcp://HOST:PORT", help="Run on the Dask cluster of this scheduler (extra `cluster`)."
)
_retry = click.option("--retry-failed", is_flag=True, help="Run again what failed in an earlier call.")


def study_options(command: Callable[..., int]) -> Callable[..., int]:
    """Where runs are made."""
    return _workers(_scheduler(_retry(command)))


def open_run_store(folder: Path, retry: bool) -> RunStore:
    """The finished runs of a folder; says how many of them cannot be read."""
    from ..results.files import check_writable
    from ..studies.execution.run_store import RunStore

    check_writable(folder)
    found = RunStore(folder, retry)
    if found.unreadable_lines:
        click.echo(f"unreadable lines in {found.path}, whose runs are made again: {found.unreadable_lines}", err=True)
    return found


def create_runner(study: Study, workers: int | None, scheduler: str | None) -> CheckingRunner:
    """The engine that the options ask for."""
    if scheduler is None:
        from ..studies.execution.local import LocalRunner

        return LocalRunner(study.context, workers or available_processors())
    if workers is not None:
        raise click.UsageError("--workers counts processes of this machine, a --scheduler has its own")
    from ..studies.cluster import ClusterRunner

    return ClusterRunner(study, scheduler)


class StudyProgress:
    """Counts runs, and says now and then how many there are, how many a second, and how long the rest takes."""

    def __init__(self, total: int, show: Callable[[str, int], None]):
        self._total, self._show, self._began = total, show, time.monotonic()
        self.finished = self.failed = self._before = 0

    def start(self, done: int) -> None:
        """So many were there already."""
        self._before = done

    def __call__(self, record: Record) -> None:
        self.finished += 1
        self.failed += bool(record.failure)
        self._show(self.text(time.monotonic() - self._began), self._before + self.finished)

    def text(self, seconds: float) -> str:
        """ "120 of 1000 runs, 3 failed, 7.5 per second, 2 min left"."""
        done = self._before + self.finished
        rate = self.finished / max(seconds, 1e-9)
        left = format_duration((self._total - done) / rate) if rate else "?"
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{done} of {self._total} runs{failed}, {rate:.3g} per second, {left} left"


def format_duration(seconds: float) -> str:
    """ "45 s", "12 min" or "3.5 h"."""
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


@contextmanager
def show_progress(total: int) -> Iterator[StudyProgress]:
    """A bar on a terminal, lines elsewhere."""
    if not sys.stderr.isatty():
        yield StudyProgress(total, _ProgressLines())
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn
    from rich.progress import Progress as Bar

    with Bar(BarColumn(), TextColumn("{task.description}"), console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=total)
        yield StudyProgress(total, lambda text, done: bar.update(task, completed=done, description=text))


class _ProgressLines:
    def __init__(self) -> None:
        self._last = time.monotonic()

    def __call__(self, text: str, done: int) -> None:
        if time.monotonic() - self._last > _LINE_INTERVAL:
            self._last = time.monotonic()
            click.echo(text, err=True)


def print_table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """A table whose first column is text, the others numbers."""
    from rich import box
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for i, name in enumerate(header):
        table.add_column(name, justify="right" if i else "left", overflow="fold")
    for row in rows:
        table.add_row(*map(escape, row))
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = 200
    console.print(table, "")
