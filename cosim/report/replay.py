"""The 3-D replay of one run, or of two laid over each other, as one file."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..results import Result
from ..results.files import replacing
from .pages import embedded, render
from .samples import is_constant, packed
from .scene import scene_of

#: of a run without a scene: plots, and signals in each
MOST_PLOTS, MOST_SIGNALS = 6, 6


def replay_data(runs: Sequence[Result]) -> dict[str, Any]:
    """What the page needs: the scene of the first run, and the signals of all. Raises InputError for a run without rows."""
    for result in runs:
        if not len(result.time):
            raise InputError(f"the result {result.metadata.get('name', '')} holds no rows, so there is nothing to replay")
    scene = scene_of(runs[0].metadata)
    plots = scene["plots"] or ([] if scene["bodies"] else _some_plots(runs[0]))
    return {"scene": {**scene, "plots": plots}, "runs": [packed(result) for result in runs]}


def _some_plots(result: Result) -> list[list[str]]:
    """For a run of which nobody says what to draw: its first numeric signals that change, if any does; one plot for a unit."""
    numeric = [name for name in result if result[name].dtype != object]
    plots: dict[str, list[str]] = {}
    for name in [name for name in numeric if not is_constant(result[name])] or numeric:
        plots.setdefault(result.units.get(name, ""), []).append(name)
    return [names[:MOST_SIGNALS] for names in islice(plots.values(), MOST_PLOTS)]


def write_replay(runs: Sequence[Result], path: Path) -> None:
    """Write the replay of `runs` (one, or two to compare) to `path`, a page that needs no other file and no network."""
    names = dict.fromkeys(str(result.metadata.get("name", "run")) for result in runs)
    description = "Two runs; the second is tinted and dashed" if len(runs) > 1 else _description(runs[0])
    text = render("replay.html", title=" and ".join(names), description=description, data=embedded(replay_data(runs)))
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _description(result: Result) -> str:
    return str(result.metadata.get("scenario", {}).get("description", ""))
