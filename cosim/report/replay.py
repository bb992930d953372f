"""The page with the 3-D replay of one run, or of two runs for comparison.

Its data contain each run in a compact form: 32-bit floats, downsampled and compressed.
"""

import base64
import math
import zlib
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
from .scene import build_scene

#: largest number of plots for a run without a scene, and of signals in each
MAX_PLOTS, MAX_SIGNALS_PER_PLOT = 6, 6
#: largest number of rows of a run, and of values of all its signals together, on a page
MAX_ROWS, MAX_VALUES = 5000, 1_000_000
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
    _write_page(path, str(result.metadata.get("name", "run")), verdict, data, failure is not None)


def _write_page(
    path: Path, title: str, description: str, data: dict[str, Any], failed: bool = False
) -> None:
    texts = {"title": title, "description": description, "failed": failed}
    write_file(path, render_page("replay.html", **texts, data=embed_json(data)))


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


def pack_run(result: Result) -> dict[str, Any]:
    """Return time and numeric signals of a run in the form that `page/src/run.js` unpacks.

    Signals that never change are in `constants`. Long runs are downsampled, but keep the extremes
    of signals. `samples` holds the float32 columns of the names `columns`, with `rows` rows each,
    encoded in these steps:

    1. differences of the 32-bit words from row to row
    2. for each column all lowest bytes, then all second bytes, and so on
    3. zlib, then base64
    """
    numeric = {name: result[name] for name in result if result[name].dtype != object}
    constants = {
        name: float(np.float32(values[0]))
        for name, values in numeric.items()
        if is_constant(values)
    }
    varying = {name: values for name, values in numeric.items() if name not in constants}
    max_rows = max(2, min(MAX_ROWS, MAX_VALUES // (len(varying) + 1)))
    columns = {"time": downsample(result.time, max_rows)}
    for name, values in varying.items():
        columns[name] = downsample_with_extremes(values, max_rows)
    return {
        "name": str(result.metadata.get("name", "run")),
        "rows": len(columns["time"]),
        "columns": list(columns),
        "constants": constants,
        "units": {name: result.units.get(name, "") for name in numeric},
        "samples": _encode_columns(columns),
    }


def is_constant(values: np.ndarray) -> bool:
    """Return True if all values are equal and finite."""
    return bool(len(values) and np.isfinite(values[0]) and (values == values[0]).all())


def _stride_blocks(values: np.ndarray, max_count: int) -> tuple[np.ndarray, int]:
    """Return the values in blocks, shape (blocks, 2 * stride), and the stride.

    The last block is padded with the last value.
    """
    stride = -(-len(values) // max_count)  # rounded up
    count = -(-len(values) // (2 * stride))
    padded = np.pad(values, (0, 2 * stride * count - len(values)), mode="edge")
    return padded.reshape(count, -1), stride


def downsample(values: np.ndarray, max_count: int) -> np.ndarray:
    """Return every n-th value and the last one, about `max_count` in all.

    Short arrays are returned as they are.
    """
    if len(values) <= max_count:
        return values
    blocks, stride = _stride_blocks(values, max_count)
    return np.append(blocks.ravel()[::stride], values[-1])


def downsample_with_extremes(values: np.ndarray, max_count: int) -> np.ndarray:
    """Downsample like `downsample`, but keep peaks.

    Where the values vary strongly within two strides, their minimum and maximum, in the order of
    time, replace the two samples.
    """
    values = values.astype(np.float32)
    samples = downsample(values, max_count)
    if len(values) <= max_count:
        return samples
    # A block spans two strides, so it has two samples: its first value and the one in its middle.
    # Its extremes move in time by less than a block, which a page cannot show. They replace the
    # samples only if the block varies more than the signal does from block to block: a slow signal
    # keeps its equidistant samples, and a short peak or noise keeps its height.
    blocks, _ = _stride_blocks(values, max_count)
    order = np.sort(np.stack([blocks.argmin(axis=1), blocks.argmax(axis=1)], axis=1), axis=1)
    change = np.abs(samples[2::2] - blocks[:, 0])  # from block to block
    has_peak = np.ptp(blocks, axis=1) > 4 * change
    samples[:-1].reshape(-1, 2)[has_peak] = np.take_along_axis(blocks, order, axis=1)[has_peak]
    return samples


def _encode_columns(columns: Mapping[str, np.ndarray]) -> str:
    # Neighbouring rows of a smooth signal differ in their low bits only. Differences of the words
    # are therefore small, and their high bytes, side by side, are runs of zeros that zlib packs.
    table = np.stack([values.astype("<f4") for values in columns.values()])
    changes = np.diff(table.view("<i4"), axis=1, prepend=np.zeros((len(table), 1), "<i4"))
    planes = changes.astype("<i4").view(np.uint8).reshape(*table.shape, 4).transpose(0, 2, 1)
    return base64.b64encode(zlib.compress(planes.tobytes())).decode("ascii")
