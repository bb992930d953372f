"""The report of a run, `report.html`: one self-contained page."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from ..core.errors import CosimError, InputError
from ..core.text import count_noun
from ..results import Result
from ..results.checks import CheckOutcome, Number, evaluate_checks
from ..results.files import to_json_types, write_file
from .diagram import build_diagram
from .figures import draw_figure, figure_to_svg
from .pages import embed_json, render_page, safe_markup
from .replay import find_failure, replay_data
from .tables import format_number

if TYPE_CHECKING:
    from ..results.kpi import NamedCall

#: labels of timings in the order of the run
TIMING_LABELS = {
    "load_seconds": "load",
    "initialize_seconds": "initialise",
    "loop_seconds": "stepping loop",
    "simulate_seconds": "simulate, in all",
}

#: largest number of file hashes on the page
MAX_HASHES = 300


class KpiRow(NamedTuple):
    """Row of the KPI table; `limits` is "" without a check."""

    name: str
    value: str
    unit: str
    limits: str = ""
    passed: bool = True


def write_report(
    result: Result, outcomes: Sequence[CheckOutcome], figures: Iterable[tuple[str, str]], path: Path
) -> None:
    """Write the report of a run, see `render_report`, to the HTML file `path`.

    Raises:
        InputError: The result has no rows, or the file cannot be written.
        OutputError: The disk is full or failed.
    """
    write_file(path, render_report(result, outcomes, figures))


def render_report(
    result: Result, outcomes: Sequence[CheckOutcome], figures: Iterable[tuple[str, str]]
) -> str:
    """Return the report of a run.

    KPIs, checks, figures, system diagram, scenario, versions, timings, warnings and replay.

    Args:
        result: The run.
        outcomes: The outcomes of the scenario's checks.
        figures: Name and SVG text of each figure; read when the rest of the page is ready, so
            drawing them may end later.

    Returns:
        A self-contained HTML page.

    Raises:
        InputError: The result has no rows.
    """
    if not len(result.time):
        raise InputError(
            f"the result {result.metadata.get('name', '')} has no rows, so there is nothing to "
            "report"
        )
    about, units = _metadata_with_defaults(result), result.metadata.get("kpi_units", {})
    failure = find_failure(result, outcomes)
    cards = []
    for each in outcomes:
        name = each.check["kpi"]
        value = format_number(each.value)
        cards.append(KpiRow(name, value, units.get(name, ""), each.limits, each.passed))
    return render_page(
        "report.html",
        about=about,
        crash=result.termination if result.crashed else "",
        failure=failure,
        checks=len(outcomes),
        failed=sum(not outcome.passed for outcome in outcomes),
        reasons=result.metadata.get("check_notes", []),
        facts=list(_facts(result)),
        cards=cards,
        kpis=_group_kpis(result.kpis, units),
        kpi_notes=result.metadata.get("kpi_notes", []),
        warnings=result.metadata.get("warnings", []),
        figures=(_figure_element(name, svg) for name, svg in figures),
        d=build_diagram(about["system"]) if about["system"] else None,
        scenario=json.dumps(about["scenario"], indent=1, ensure_ascii=False),
        timings=list(_timings(result)),
        versions=[*about["versions"].items(), *about["machine"].items()],
        data=embed_json({**replay_data([result]), "failure": failure and failure._asdict()}),
    )


def _metadata_with_defaults(result: Result) -> dict[str, Any]:
    """Return the metadata of a run with defaults for all keys that the template uses."""
    missing: dict[str, Any] = {
        "name": "run",
        "failure": None,
        "deviation": [],
        "scenario": {},
        "scenario_file": "",
        "system": None,
        "versions": {"cosim": ""},
        "machine": {},
        "sha256": {},
    }
    about = to_json_types({**missing, **result.metadata})
    hashes = about["sha256"]
    return {**about, "sha256": dict(islice(hashes.items(), MAX_HASHES)), "file_count": len(hashes)}


def _facts(result: Result) -> Iterator[tuple[str, str]]:
    simulated = float(result.time[-1] - result.time[0])
    yield "simulated", f"{simulated:g} s"
    if loop := result.timing.get("loop_seconds"):
        yield "computing speed", f"{simulated / loop:.0f} × real time"
    yield "signals", str(len(result))
    yield "rows", str(len(result.time))
    if events := result.metadata.get("live_events"):
        yield "set by hand", count_noun(len(events), "time")
    if result.termination and not result.crashed:  # a crash is at the top
        yield "end", result.termination


def _group_kpis(kpis: Mapping[str, Number], units: Mapping[str, str]) -> dict[str, list[KpiRow]]:
    """Return the values of each KPI function, by its name and without its name as their prefix."""
    groups: dict[str, list[KpiRow]] = {}
    for name, value in kpis.items():
        group, _, own = name.partition(".")
        row = KpiRow(own, format_number(value), units.get(name, ""))
        groups.setdefault(group, []).append(row)
    return groups


def _timings(result: Result) -> Iterator[tuple[str, str]]:
    for key, label in TIMING_LABELS.items():
        if key in result.timing:
            yield label, f"{1e3 * result.timing[key]:.0f} ms"
    if pace := result.metadata.get("real_time"):
        yield "real time", f"{pace['late_steps']} of {count_noun(pace['steps'], 'step')} late"


def _figure_element(name: str, svg: str) -> dict[str, Any]:
    """Return an SVG file as an element of the page; `drawn` is False if it contains a bitmap."""
    return {
        "name": name,
        "svg": safe_markup(svg[svg.index("<svg") :]),
        "drawn": "<image" not in svg,
    }


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
    from .runs import read_run

    run = read_run(folder)
    checks = run.metadata.get("scenario", {}).get("checks", [])
    outcomes = evaluate_checks(run.kpis, [check for check in checks if check["kpi"] in run.kpis])
    is_accepted = (
        not run.crashed
        and len(outcomes) == len(checks)
        and all(outcome.passed for outcome in outcomes)
    )
    if deviation:
        run.metadata["deviation"] = list(_deviation_lines(run, deviation, is_accepted))
    write_report(run, outcomes, draw_scenario_figures(run, more_figures), target)


def _deviation_lines(run: Result, deviation: Deviation, is_accepted: bool) -> Iterator[str]:
    """Yield the lines about a failed comparison.

    Verdict, deviations, reason of the tolerances, and how to accept the run.
    """
    yield from deviation.summary.splitlines()
    reason = (run.metadata.get("scenario", {}).get("reference") or {}).get("reason")
    notes = (
        reason and f"reason of the tolerances: {reason}",
        deviation.changes,
        is_accepted and deviation.accept,
    )
    yield from (note[0].upper() + note[1:] for note in notes if note)


def draw_scenario_figures(
    run: Result, more_figures: Iterable[NamedCall] = ()
) -> Iterator[tuple[str, str]]:
    """Yield name and SVG text of the figures of a run's scenario.

    The result of a run that failed may lack what a figure needs. Such a figure is logged.

    Args:
        run: The run.
        more_figures: Figures that are drawn before those of the scenario.
    """
    from .runs import load_figures

    for name, function, arguments in [*more_figures, *load_figures(run)]:
        try:
            yield name, figure_to_svg(draw_figure(run, name, function, arguments))
        except CosimError as error:
            if not run.metadata.get("failure"):
                raise
            logging.getLogger("cosim").warning("the report lacks a figure: %s", error)
