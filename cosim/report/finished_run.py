"""Report of a run that has been written to a folder."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from pathlib import Path

from ..core.errors import CosimError
from ..results import Result
from ..results.checks import evaluate_checks
from .figures import draw_figure, figure_to_svg
from .run_page import write_report
from .runs import NamedCall, load_figures, read_run


def write_folder_report(folder: Path, target: Path, more_figures: Iterable[NamedCall] = ()) -> None:
    """Write the report of the run in a folder: KPIs, checks, figures, system and 3-D replay.

    The report of a run that failed shows the cause and what was recorded until then. Its figures are drawn as far as that is
    possible; the others are logged as warnings.

    Args:
        folder: Folder that `cosim run` wrote.
        target: The HTML file.
        more_figures: Name, function and arguments of figures that are drawn before those of the scenario.

    Raises:
        InputError: The folder or the figures cannot be read, or the result has no rows.
        ComponentError: A figure of a complete run cannot be drawn.
    """
    run = read_run(folder)
    checks = run.metadata.get("scenario", {}).get("checks", [])
    outcomes = evaluate_checks(run.kpis, [check for check in checks if check["kpi"] in run.kpis])
    write_report(run, outcomes, _draw_figures(run, [*more_figures, *load_figures(run)]), target)


def _draw_figures(run: Result, figures: Iterable[NamedCall]) -> Iterator[tuple[str, str]]:
    """Yield name and SVG text of the figures."""
    for name, function, arguments in figures:
        try:
            yield name, figure_to_svg(draw_figure(run, name, function, arguments))
        except CosimError as error:
            if not run.metadata.get("failure"):
                raise
            logging.getLogger("cosim").warning("the report lacks a figure: %s", error)
