"""`sweep.html`: what a sweep comes to, on one page that needs no network and runs no script."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import __version__
from ..kpi import evaluate_checks
from ..report.figures import save, svg
from ..report.pages import markup, render
from ..results.files import replacing
from .design import Factor
from .map_figure import draw_map
from .maps import Cell, SuccessMap
from .outcome import Summary, run_command
from .replays import page_of, settings_of
from .sweep import Sweep

PAGE = "sweep.html"
#: so many different labels of a factor are listed
_LISTED = 12


def write_page(sweep: Sweep, summary: Summary, maps: Sequence[SuccessMap], folder: Path) -> None:
    """Write every map as NAME.png and NAME.svg, and sweep.html: maps, success by levels, KPIs, causes of failures, the design.

    A click on a cell of a map leads to the replay of one of its runs where there is one, else to the command that shows it.
    """
    overall = summary.groups[0] if summary.groups else None
    cells = list(_cells(sweep, maps, folder))
    text = render(
        "sweep.html",
        spec=sweep.read.spec,
        total=len(sweep),
        summary=summary,
        overall=overall,
        design=list(_design(sweep)),
        criteria=[_limits(check) for check in sweep.criteria],
        maps=[_drawn(sweep, each, folder) for each in maps],
        commands=[cell for cell in cells if cell["link"].startswith(PAGE)],
        replays=[cell for cell in cells if not cell["link"].startswith(PAGE)],
        kpis=list(overall.statistics()) if overall else [],
        version=__version__,
        file=sweep.read.document.file,
    )
    with replacing(folder / PAGE) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _limits(check: Mapping[str, Any]) -> tuple[str, str]:
    """A criterion as (KPI, limits)."""
    (outcome,) = evaluate_checks({check["kpi"]: 0.0}, [check])
    return check["kpi"], outcome.limits


def _design(sweep: Sweep) -> Iterator[tuple[str, str]]:
    for factor in sweep.design.factors:
        yield factor.name, _levels(factor)
    if seeds := sweep.design.seeds:
        yield "seed", f"{seeds[0].label} ... {seeds[-1].label}"
    design = sweep.read.spec.design
    yield "design", design.kind.replace("_", " ") + (f", seed {design.seed}" if design.runs else "")


def _levels(factor: Factor) -> str:
    levels = factor.listed or (factor.grid if len(factor.grid) <= _LISTED else ())
    if levels:
        return ", ".join(str(level.label) for level in levels)
    low, high = factor.at(0.0).label, factor.at(1 - 1e-9).label
    return f"{low:.4g} ... {high:.4g}"


def _drawn(sweep: Sweep, map_: SuccessMap, folder: Path) -> dict[str, Any]:
    """A map in its files; as SVG whose cells are links, and the width (in) that it was drawn for."""
    figure = draw_map(map_, lambda cell: _link(sweep, cell, folder))
    save(figure, folder / f"{map_.name}.png")
    text = svg(figure).replace(' target="_blank"', "")
    with replacing(folder / f"{map_.name}.svg") as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return {"svg": markup(text[text.index("<svg") :]), "width": figure.get_figwidth()}


def _link(sweep: Sweep, cell: Cell, folder: Path) -> str:
    if cell.shown is None:
        return ""
    page = page_of(sweep, cell.shown.number)
    return page if (folder / page).exists() else f"{PAGE}#run-{cell.shown.number}"


def _cells(sweep: Sweep, maps: Iterable[SuccessMap], folder: Path) -> Iterator[dict[str, Any]]:
    """The run that each cell shows, once."""
    shown = {cell.shown.number: cell for map_ in maps for cell in map_.cells.values() if cell.shown is not None}
    for number, cell in sorted(shown.items()):
        command = run_command(sweep.read.scenario, settings_of(sweep, number))
        yield {"run": number, "cell": cell, "link": _link(sweep, cell, folder), "command": command}
