"""Moment of the failure of a run, before which its replay opens."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..results import Result
from ..results.checks import CheckOutcome

#: time between the opening of the replay and the failure (s)
LEAD_TIME = 2.0


class Failure(NamedTuple):
    """Time (s) and label of a failure, and the time (s) at which the replay opens."""

    time: float
    label: str
    opens: float


def find_failure(result: Result, outcomes: Sequence[CheckOutcome]) -> Failure | None:
    """Return the failure of a run; None if it ended with all checks passed.

    A component that failed: the last row. A crash: the time at which its condition was met. A check: the value `time` of the same
    KPI function (of a touchdown, for example) if there is one, else the last row.
    """
    failed = [outcome for outcome in outcomes if not outcome.passed]
    if result.metadata.get("failure"):
        time, label = float(result.time[-1]), "failure"
    elif result.crashed:
        time, label = float(result.metadata["terminated_by"]["since"]), "crash"
    elif failed:
        name = failed[0].check["kpi"]
        time = float(result.kpis.get(f"{name.partition('.')[0]}.time", math.nan))
        time, label = time if math.isfinite(time) else float(result.time[-1]), f"check of {name} failed"
    else:
        return None
    return Failure(time, label, max(float(result.time[0]), time - LEAD_TIME))
