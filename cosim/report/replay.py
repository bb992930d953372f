"""The 3-D replay of one run, or of two laid over each other, as one file."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..results import Result
from ..results.files import writing_atomically
from .pages import embed_json, render_page
from .samples import is_constant, pack_run
from .scene import build_scene

#: of a run without a scene: plots, and signals in each
MAX_PLOTS, MAX_SIGNALS_PER_PLOT = 6, 6


def replay_data(runs: Sequence[Result]) -> dict[str, Any]:
    """What the page needs: the scene of the first run, and the signals of all. Raises InputError for a run without rows."""
    for result in runs:
        if not len(result.time):
            raise InputError(f"the result {result.metadata.get('name', '')} holds no rows, so there is nothing to replay")
    scene = build_scene(runs[0].metadata)
    plots = scene["plots"] or ([] if scene["bodies"] else _default_plots(runs[0]))
    return {"scene": {**scene, "plots": plots}, "runs": [pack_run(result) for result in runs]}


def _default_plots(result: Result) -> list[list[str]]:
    """For a run of which nobody says what to draw: its first numeric signals that change, if any does; one plot for a unit."""
    numeric = [name for name in result if result[name].dtype != object]
    plots: dict[str, list[str]] = {}
    for name in [name for name in numeric if not is_constant(result[name])] or numeric:
        plots.setdefault(result.units.get(name, ""), []).append(name)
    return [names[:MAX_SIGNALS_PER_PLOT] for names in islice(plots.values(), MAX_PLOTS)]


def write_replay(runs: Sequence[Result], path: Path) -> None:
    """Write the replay of `runs` (one, or two to compare) to `path`, a page that needs no other file and no network."""
    names = dict.fromkeys(str(result.metadata.get("name", "run")) for result in runs)
    description = "Two runs; the second is tinted and dashed" if len(runs) > 1 else _description(runs[0])
    text = render_page("replay.html", title=" and ".join(names), description=description, data=embed_json(replay_data(runs)))
    with writing_atomically(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _description(result: Result) -> str:
    return str(result.metadata.get("scenario", {}).get("description", ""))
