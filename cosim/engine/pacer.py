"""Real time: macro steps that wait for the clock on the wall."""

from __future__ import annotations

import time
from array import array
from fractions import Fraction
from typing import Any, Literal

import numpy as np

from ..core import component_log
from ..core.errors import LateError
from ..core.time_grid import TimeGrid

#: what happens when a step is ready more than one step too late
LatePolicy = Literal["warn", "fail"]


class Pacer:
    """Lets communication point n come no earlier than n * step / factor after the start.

    Deadlines are absolute and computed from whole nanoseconds, so nothing adds up: a step that was late makes the following
    ones begin at once until the clock is met again. Waiting is sleeping, which an interrupt ends. Lateness is how long after
    its deadline a step was ready, 0 when it was in time.
    """

    def __init__(self, grid: TimeGrid, factor: float, late: LatePolicy):
        self._grid, self._factor, self._late = grid, factor, late
        interval = grid.step * 10**9 / Fraction(factor)
        self._numerator, self._denominator = interval.numerator, interval.denominator
        self._lateness = array("q")
        self._warned = False
        self._start = 0

    def start(self, n: int = 0) -> None:
        """Communication point n is now."""
        self._start = time.monotonic_ns() - n * self._numerator // self._denominator

    def wait(self, n: int) -> None:
        """Until communication point n is due. Raises LateError when it was due more than one step ago and late steps fail."""
        ahead = self._start + n * self._numerator // self._denominator - time.monotonic_ns()
        self._lateness.append(max(0, -ahead))
        if ahead > 0:
            time.sleep(ahead * 1e-9)
        elif -ahead * self._denominator > self._numerator:
            self._report_lateness(n, -ahead * 1e-9)

    def _report_lateness(self, n: int, late: float) -> None:
        step = float(self._grid.step) / self._factor
        text = f"t = {self._grid.time_at(n):.12g} s was reached {late:.3g} s late, more than one step ({step:.3g} s)"
        if self._late == "fail":
            raise LateError(f"too slow for {self._factor:g} times real time: {text}")
        if not self._warned:
            self._warned = True
            component_log.log_message(
                "real time", component_log.WARNING, f"{text}; said once, the number of late steps stands at the end"
            )

    def statistics(self) -> dict[str, Any]:
        """How late the steps were (s), and how many were late at all."""
        lateness = np.array(self._lateness, np.float64) * 1e-9 if self._lateness else np.zeros(1)
        return {
            "factor": self._factor,
            "steps": len(self._lateness),
            "late_steps": int(np.count_nonzero(lateness)),
            "max_lateness": float(lateness.max()),
            "mean_lateness": float(lateness.mean()),
            "lateness_99_percent": float(np.percentile(lateness, 99)),
        }
