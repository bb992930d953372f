"""Page `sweep.html` with the results of a sweep, and the replay pages of single runs.

The page needs no network. A replay is named after the key of its run and a hash of its texts, so
that it is written once and belongs to one sweep only.
"""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...core import __version__
from ...report.figures import figure_to_svg, save_figure
from ...report.pages import render_page, safe_markup
from ...results.checks import evaluate_checks
from ...results.files import remove_files, write_file
from ..design import Design
from ..execution.job import Job, Record
from ..execution.run import ReplayRequest
from ..execution.worker_pool import LocalRunner
from ..sweep import Sweep, SweepRow
from .success_map import MAP_NAME, MapCell, SuccessMap
from .success_map_figure import draw_map
from .sweep_files import SweepSummary
from .unsuccessful_runs import criterion_limits, run_command, run_settings

PAGE_FILE = "sweep.html"
_MAP_FILE = re.compile(rf"{MAP_NAME}(_\d+)?\.(png|svg)")
#: largest number of levels of a factor that are listed
_MAX_LISTED_LEVELS = 12


def write_sweep_page(
    sweep: Sweep,
    rows: Iterable[SweepRow],
    summary: SweepSummary,
    maps: Sequence[SuccessMap],
    folder: Path,
) -> None:
    """Write every map as NAME.png and NAME.svg, and sweep.html.

    The page shows maps, success rates, KPIs, failures and the design. Each cell of a map is a link
    to the replay of one of its runs if there is one, else to the command that repeats that run.
    Maps of an earlier call are removed.

    Args:
        sweep: the sweep.
        rows: its finished runs.
        summary: its statistics.
        maps: its success maps.
        folder: the output directory.
    """
    overall = summary.groups[0] if summary.groups else None
    found = {path.name for path in folder.glob(f"{MAP_NAME}*") if _MAP_FILE.fullmatch(path.name)}
    for each in maps:
        found -= {f"{each.name}.png", f"{each.name}.svg"}
    remove_files(folder, *found)
    statistics = overall.shown_statistics() if overall else ()
    cells = list(_shown_cells(sweep, rows, summary.units, maps, folder))
    criteria = []
    for check in sweep.criteria:
        (outcome,) = evaluate_checks({check["kpi"]: 0.0}, [check])
        criteria.append((check["kpi"], criterion_limits(outcome, summary.units)))
    text = render_page(
        "sweep.html",
        spec=sweep.study_file.spec,
        total=len(sweep),
        summary=summary,
        overall=overall,
        design=list(_design_rows(sweep)),
        criteria=criteria,
        maps=[_write_map(sweep, each, folder) for each in maps],
        commands=[cell for cell in cells if cell["link"].startswith(PAGE_FILE)],
        replays=[cell for cell in cells if not cell["link"].startswith(PAGE_FILE)],
        kpis=[(name, summary.units.get(name, ""), numbers) for name, numbers in statistics],
        version=__version__,
        file=sweep.study_file.document.file,
    )
    write_file(folder / PAGE_FILE, text)


def _design_rows(sweep: Sweep) -> Iterator[tuple[str, str]]:
    for i, factor in enumerate(sweep.design.factors):
        yield factor.name, _level_summary(sweep.design, i)
    if seeds := sweep.design.seeds:
        yield "seed", f"{seeds[0].label} ... {seeds[-1].label}"
    design = sweep.study_file.spec.design
    yield "design", design.kind.replace("_", " ") + (f", seed {design.seed}" if design.runs else "")


def _level_summary(design: Design, number: int) -> str:
    """Return the levels of a factor as text: all of them, or the lowest and the highest."""
    factor = design.factors[number]
    if factor.listed_levels or (
        design.unit_samples is None and len(factor.grid_levels) <= _MAX_LISTED_LEVELS
    ):
        return ", ".join(str(level.label) for level in factor.grid_levels)
    if design.unit_samples is None:
        ends = factor.grid_levels[0], factor.grid_levels[-1]
    else:
        samples = design.unit_samples[:, number]
        ends = factor.level_at(float(samples.min())), factor.level_at(float(samples.max()))
    return " ... ".join(f"{level.label:.4g}" for level in ends)


def _write_map(sweep: Sweep, map_: SuccessMap, folder: Path) -> dict[str, Any]:
    """Write a map to its files; return its SVG with links in the cells, and its width (in)."""
    figure = draw_map(map_, lambda cell: _cell_link(sweep, cell, folder))
    save_figure(figure, folder / f"{map_.name}.png")
    text = figure_to_svg(figure).replace(' target="_blank"', "")
    write_file(folder / f"{map_.name}.svg", text)
    in_page = text[text.index("<svg") :].replace(
        f'"{PAGE_FILE}#', '"#'
    )  # a copy of the page may have another name
    return {"svg": safe_markup(in_page), "width": figure.get_figwidth()}


def _cell_link(sweep: Sweep, cell: MapCell, folder: Path) -> str:
    if cell.representative_run is None:
        return ""
    page = replay_path(sweep, cell.representative_run.number)
    return page if (folder / page).exists() else f"{PAGE_FILE}#run-{cell.representative_run.number}"


def _shown_cells(
    sweep: Sweep,
    rows: Iterable[SweepRow],
    units: Mapping[str, str],
    maps: Iterable[SuccessMap],
    folder: Path,
) -> Iterator[dict[str, Any]]:
    """Yield each run that represents a cell, once, with its command and why it is no success."""
    shown: dict[int, MapCell] = {}
    for map_ in maps:
        for cell in map_.cells.values():
            if cell.representative_run is not None:
                shown[cell.representative_run.number] = cell
    reasons = {row.run: _reasons(sweep, row, units) for row in rows if row.run in shown}
    for number, cell in sorted(shown.items()):
        texts = {"reasons": reasons[number], "command": run_command(sweep, number)}
        yield {"run": number, "cell": cell, "link": _cell_link(sweep, cell, folder), **texts}


def _reasons(sweep: Sweep, row: SweepRow, units: Mapping[str, str]) -> list[str]:
    """Return why a run is no success: the failure, or the criteria that it misses."""
    return (
        [row.record.failure]
        if row.record.failure
        else [outcome.text(units) for outcome in sweep.missed(row.record.kpis)]
    )


REPLAY_FOLDER = "replays"


def replay_path(sweep: Sweep, run: int) -> str:
    """Return the path of a run's replay, relative to the folder of the sweep."""
    text = json.dumps([_replay_title(sweep, run), sweep.criteria])
    return f"{REPLAY_FOLDER}/{sweep.keys[run]}-{sha256(text.encode()).hexdigest()[:8]}.html"


def remove_foreign_replays(sweep: Sweep, folder: Path) -> None:
    """Remove replays of runs that are not part of the sweep.

    Of another sweep, or of earlier versions of its files.
    """
    pages = list((folder / REPLAY_FOLDER).glob("*.html"))
    own = {Path(replay_path(sweep, run)).name for run in range(len(sweep))} if pages else set()
    remove_files(folder / REPLAY_FOLDER, *(page.name for page in pages if page.name not in own))


def write_replays(sweep: Sweep, runs: Iterable[int], folder: Path, workers: int) -> dict[int, str]:
    """Write the missing replays by repeating their runs.

    Return the failure of each run whose replay is still missing.
    """
    pages = {run: folder / replay_path(sweep, run) for run in dict.fromkeys(runs)}
    missing = {run: page for run, page in pages.items() if not page.exists()}
    (folder / REPLAY_FOLDER).mkdir(exist_ok=True)
    with LocalRunner(sweep.study.context, workers) as runner, ThreadPoolExecutor(workers) as pool:

        def write(run: int, page: Path) -> Record:
            job = Job(sweep.keys[run], run_settings(sweep, run))
            title = _replay_title(sweep, run)
            request = ReplayRequest(title, str(page.resolve()), sweep.criteria)
            return runner.worker_pool.replay(job, request)

        records = pool.map(write, missing, missing.values())
        causes = {run: record.failure for run, record in zip(missing, records, strict=True)}
    return {run: causes[run] for run, page in missing.items() if not page.exists()}


def _replay_title(sweep: Sweep, run: int) -> str:
    labels = ", ".join(f"{name} {label}" for name, label in sweep.design[run].labels.items())
    return f"{sweep.study_file.spec.name} run {run}: {labels}"
