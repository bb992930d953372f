"""Connection of results with the functions of the report that show them, which are imported on first use."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..results import Result
from ..results.result import Presentation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def enable() -> None:
    """Make `Result.plot` and the notebook view of results available."""
    Presentation.plot, Presentation.html, Presentation.write_report = _plot, _html, _write_report


def _plot(result: Result, signals: Sequence[str]) -> Figure:
    from ..report.inline import plot_signals

    return plot_signals(result, signals)


def _html(result: Result) -> str:
    from ..report.inline import result_as_html

    return result_as_html(result)


def _write_report(folder: Path) -> None:
    from ..report.finished_run import write_folder_report

    write_folder_report(folder, folder / "report.html")
