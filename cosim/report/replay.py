"""The page with the 3-D replay of one run, or of two runs for comparison."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError
from ..results import Result
from ..results.checks import CheckOutcome
from ..results.files import write_file
from ..results.signal_analysis import control_error
from .pages import embed_json, render_page
from .samples import is_constant, pack_run
from .scene import build_scene

#: largest number of plots for a run without a scene, and of signals in each
MAX_PLOTS, MAX_SIGNALS_PER_PLOT = 6, 6
#: time between the opening of the replay and the failure (s)
LEAD_TIME = 2.0

#: KPI functions whose value is that of one row, and the quantity that is largest in this row
_EXTREMES: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "cosim.kpis:peak": np.abs,
    "cosim.kpis:maximum": np.positive,
    "cosim.kpis:minimum": np.negative,
}


def replay_data(runs: Sequence[Result]) -> dict[str, Any]:
    """Return the data of the page: the scene of the first run and the signals of all runs.

    Raises:
        InputError: A run has no rows, or its scene cannot be built.
    """
    for result in runs:
        if not len(result.time):
            raise InputError(
                f"the result {result.metadata.get('name', '')} has no rows, so there is nothing to "
                "replay"
            )
    scene = build_scene(runs[0].metadata)
    checked = list(_group_by_unit(runs[0], _checked_signals(runs[0])))
    others = scene["plots"] or ([] if scene["bodies"] else _default_plots(runs[0]))
    plots = [*checked, *(plot for plot in others if plot not in checked)]
    return {"scene": {**scene, "plots": plots}, "runs": [pack_run(result) for result in runs]}


def _default_plots(result: Result) -> list[list[str]]:
    """Return the first numeric signals, grouped by unit; constant ones only if all are constant."""
    numeric = [name for name in result if result[name].dtype != object]
    return list(
        _group_by_unit(
            result, [name for name in numeric if not is_constant(result[name])] or numeric
        )
    )


def _group_by_unit(result: Result, names: Iterable[str]) -> Iterator[list[str]]:
    """Return the signals of each plot; all signals of a plot have the same unit."""
    plots: dict[str, list[str]] = {}
    for name in names:
        plots.setdefault(result.units.get(name, ""), []).append(name)
    return (found[:MAX_SIGNALS_PER_PLOT] for found in islice(plots.values(), MAX_PLOTS))


def _checked_signals(result: Result) -> Iterable[str]:
    """Return the numeric signals in the arguments of those KPIs that are checked, each once."""
    scenario = result.metadata.get("scenario", {})
    checked = {check["kpi"].partition(".")[0] for check in scenario.get("checks", [])}
    found: dict[str, None] = {}
    for kpi in scenario.get("kpis", []):
        if kpi["name"] not in checked:
            continue
        for value in kpi.get("arguments", {}).values():
            if isinstance(value, str) and value in result and result[value].dtype != object:
                found[value] = None
    return found


def write_replay(runs: Sequence[Result], path: Path) -> None:
    """Write the replay of one run, or of two runs for comparison, as a self-contained page."""
    names = dict.fromkeys(str(result.metadata.get("name", "run")) for result in runs)
    description = (
        "Two runs; the second is tinted and dashed" if len(runs) > 1 else _description(runs[0])
    )
    _write_page(path, " and ".join(names), description, replay_data(runs))


def write_judged_replay(result: Result, outcomes: Sequence[CheckOutcome], path: Path) -> None:
    """Write the replay of a run that marks the failure and opens before it.

    It names the failed checks; see `find_failure`.

    Args:
        result: The run.
        outcomes: Outcomes of the checks.
        path: The HTML file.
    """
    failure, units = find_failure(result, outcomes), result.metadata.get("kpi_units") or {}
    reasons = [outcome.text(units) for outcome in outcomes if not outcome.passed]
    cause = (
        result.metadata.get("failure")
        or (result.termination if result.crashed else "")
        or "; ".join(reasons)
    )
    data = {**replay_data([result]), "failure": failure and failure._asdict()}
    verdict = "Successful." if outcomes else _description(result)
    if failure:
        verdict = f"Not successful: {cause.rstrip('.')}. {failure}"
    _write_page(
        path, str(result.metadata.get("name", "run")), verdict, data, failed=failure is not None
    )


def _write_page(
    path: Path, title: str, description: str, data: dict[str, Any], failed: bool = False
) -> None:
    text = render_page(
        "replay.html", title=title, description=description, data=embed_json(data), failed=failed
    )
    write_file(path, text)


def _description(result: Result) -> str:
    return str(result.metadata.get("scenario", {}).get("description", ""))


class Failure(NamedTuple):
    """Time (s) and label of a failure, and the time (s) at which the replay opens."""

    time: float
    label: str
    opens: float

    def __str__(self) -> str:
        """Return the sentences about the mark and the opening of the replay."""
        return (
            f"The replay opens at t = {self.opens:.6g} s. Mark × at t = {self.time:.6g} s: "
            f"{self.label}."
        )


def find_failure(result: Result, outcomes: Sequence[CheckOutcome]) -> Failure | None:
    """Return the failure of a run; None if it ended with all checks passed.

    A component that failed: the last row. A crash: the time at which its condition was met. A
    check: the value `time` of the same KPI function (of a touchdown, for example) if there is one,
    the row of a peak, a maximum or a minimum, else the last row.
    """
    failed = [outcome for outcome in outcomes if not outcome.passed]
    if result.metadata.get("failure"):
        time, label = float(result.time[-1]), "failure"
    elif result.crashed:
        ended = result.metadata["terminated_by"] or {}
        time, label = float(ended["since"]), "crash"
    elif failed:
        name = failed[0].check["kpi"]
        time, label = _kpi_time(result, name.partition(".")[0]), f"check of {name} failed"
        if not math.isfinite(time):
            time, label = float(result.time[-1]), f"end of the run, {label}"
    else:
        return None
    return Failure(time, label, max(float(result.time[0]), time - LEAD_TIME))


def _kpi_time(result: Result, name: str) -> float:
    """Return the time (s) at which the value of a KPI arose, NaN if it has none."""
    if f"{name}.time" in result.kpis:
        return float(result.kpis[f"{name}.time"])
    for kpi in result.metadata.get("scenario", {}).get("kpis", []):
        if kpi["name"] == name and kpi["python"] in _EXTREMES:
            given = {"target": 0.0, "start": -math.inf, "stop": math.inf, **kpi["arguments"]}
            time, error = control_error(result, **given)
            if error.size:
                return float(time[np.argmax(_EXTREMES[kpi["python"]](error))])
    return math.nan
