"""Report of a run that has been written to a folder."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from ..core.errors import CosimError
from ..results import Result
from ..results.checks import evaluate_checks
from .figures import draw_figure, figure_to_svg
from .run_page import write_report
from .runs import NamedCall, load_figures, read_run


class Deviation(NamedTuple):
    """Failed comparison with a reference.

    Attributes:
        summary: Number of the signals that failed, which becomes the verdict, and one line for each
            of them.
        changes: What has changed since the reference was made; "" if nothing is known.
        accept: How to make the run the reference, which is shown if its checks passed; "" if
            unknown.
    """

    summary: str
    changes: str = ""
    accept: str = ""


def write_folder_report(
    folder: Path,
    target: Path,
    more_figures: Iterable[NamedCall] = (),
    deviation: Deviation | None = None,
) -> None:
    """Write the report of the run in a folder: KPIs, checks, figures, system and 3-D replay.

    The report of a run that failed shows the cause and what was recorded until then. Its figures
    are drawn as far as that is possible; the others are logged as warnings.

    Args:
        folder: Folder that `cosim run` wrote.
        target: The HTML file.
        more_figures: Name, function and arguments of figures that are drawn before those of the
            scenario.
        deviation: Failed comparison with a reference.

    Raises:
        InputError: The folder or the figures cannot be read, or the result has no rows.
        ComponentError: A figure of a complete run cannot be drawn.
    """
    run = read_run(folder)
    checks = run.metadata.get("scenario", {}).get("checks", [])
    outcomes = evaluate_checks(run.kpis, [check for check in checks if check["kpi"] in run.kpis])
    is_accepted = (
        not run.crashed
        and len(outcomes) == len(checks)
        and all(outcome.passed for outcome in outcomes)
    )
    run.metadata["deviation"] = (
        list(_deviation_lines(run, deviation, is_accepted)) if deviation else []
    )
    write_report(run, outcomes, _draw_figures(run, [*more_figures, *load_figures(run)]), target)


def _deviation_lines(run: Result, deviation: Deviation, is_accepted: bool) -> Iterator[str]:
    """Yield the verdict of a failed comparison, the deviations, the reason of the tolerances, and how to accept the run."""
    yield from deviation.summary.splitlines()
    reason = (run.metadata.get("scenario", {}).get("reference") or {}).get("reason")
    notes = (
        reason and f"reason of the tolerances: {reason}",
        deviation.changes,
        is_accepted and deviation.accept,
    )
    yield from (note[0].upper() + note[1:] for note in notes if note)


def _draw_figures(run: Result, figures: Iterable[NamedCall]) -> Iterator[tuple[str, str]]:
    """Yield name and SVG text of the figures."""
    for name, function, arguments in figures:
        try:
            yield name, figure_to_svg(draw_figure(run, name, function, arguments))
        except CosimError as error:
            if not run.metadata.get("failure"):
                raise
            logging.getLogger("cosim").warning("the report lacks a figure: %s", error)
