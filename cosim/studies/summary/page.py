"""`sweep.html`: what a sweep comes to, on one page that needs no network and runs no script."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ...core.version import __version__
from ...report.figures import save, svg
from ...report.pages import markup, render
from ...results.checks import evaluate_checks
from ...results.files import remove, replacing
from ..design import Design
from ..sweep import Sweep
from .files import Summary, run_command
from .replays import page_of, settings_of
from .success_map import MAP, Cell, SuccessMap
from .success_map_figure import draw_map

PAGE = "sweep.html"
_FILE = re.compile(rf"{MAP}(_\d+)?\.(png|svg)")
#: so many different labels of a factor are listed
_LISTED = 12


def write_page(sweep: Sweep, summary: Summary, maps: Sequence[SuccessMap], folder: Path) -> None:
    """Write every map as NAME.png and NAME.svg, and sweep.html: maps, success by levels, KPIs, causes of failures, the design.

    A click on a cell of a map leads to the replay of one of its runs where there is one, else to the command that shows it. Maps
    that an earlier call wrote and this one does not are removed.
    """
    overall = summary.groups[0] if summary.groups else None
    drawn = {f"{each.name}{suffix}" for each in maps for suffix in (".png", ".svg")}
    remove(folder, *(path.name for path in folder.glob(f"{MAP}*") if _FILE.fullmatch(path.name) and path.name not in drawn))
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
    for i, factor in enumerate(sweep.design.factors):
        yield factor.name, _levels(sweep.design, i)
    if seeds := sweep.design.seeds:
        yield "seed", f"{seeds[0].label} ... {seeds[-1].label}"
    design = sweep.read.spec.design
    yield "design", design.kind.replace("_", " ") + (f", seed {design.seed}" if design.runs else "")


def _levels(design: Design, number: int) -> str:
    """All levels of a factor, of many the lowest and the highest."""
    factor = design.factors[number]
    if factor.listed or (design.samples is None and len(factor.grid) <= _LISTED):
        return ", ".join(str(level.label) for level in factor.grid)
    if design.samples is None:
        ends = factor.grid[0], factor.grid[-1]
    else:
        places = design.samples[:, number]
        ends = factor.at(float(places.min())), factor.at(float(places.max()))
    return " ... ".join(f"{level.label:.4g}" for level in ends)


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
