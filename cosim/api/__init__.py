"""Python interface: load a scenario, and run it or step it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ..results import Result
from ..results.result import Presentation
from .execution import evaluate_scenario_checks
from .simulation import Simulation, load, run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["Result", "Simulation", "evaluate_scenario_checks", "load", "run"]


def _plot(result: Result, signals: Sequence[str]) -> Figure:
    from ..report.inline import plot_signals

    return plot_signals(result, signals)


def _html(result: Result) -> str:
    from ..report.inline import result_as_html

    return result_as_html(result)


def _write_report(folder: Path) -> None:
    from ..report.run_page import write_folder_report

    write_folder_report(folder, folder / "report.html")


# results lie below the report in the layers, so their views are connected here
Presentation.plot, Presentation.html, Presentation.write_report = _plot, _html, _write_report
