"""Moment of the failure of a run, before which its replay opens."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..results import Result
from ..results.checks import CheckOutcome
from ..results.signal_analysis import control_error

#: time between the opening of the replay and the failure (s)
LEAD_TIME = 2.0

#: KPI functions whose value is that of one row, and the quantity that is largest in this row
_EXTREMES: Mapping[str, Callable[[np.ndarray], np.ndarray]] = {
    "cosim.kpis:peak": np.abs,
    "cosim.kpis:maximum": np.positive,
    "cosim.kpis:minimum": np.negative,
}


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
        time, label = float(result.metadata["terminated_by"]["since"]), "crash"
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
            return (
                float(time[np.argmax(_EXTREMES[kpi["python"]](error))]) if error.size else math.nan
            )
    return math.nan
