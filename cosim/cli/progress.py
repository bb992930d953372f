"""Progress bar of long commands."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from . import current_command_line


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

    from ..process.standard_streams import unescaped
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
