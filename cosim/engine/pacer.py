"""Wall time: pacing of a run to real time, and measurement of its parts."""

import time
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from time import perf_counter
from typing import Any, Literal

import numpy as np

from ..core import component_log
from ..core.errors import LateError
from ..core.time_grid import TimeGrid

#: reaction to a step that is more than one step late: one warning, or a LateError
LatePolicy = Literal["warn", "fail"]

#: longest wait in one call of the operating system, which accepts only some years (ns)
_LONGEST_SLEEP = 10**15


class Pacer:
    """Delays communication point n until n * step / factor after the start.

    Deadlines are absolute and computed in whole nanoseconds, so errors do not accumulate: after a
    late step the following ones start immediately until the run has caught up. Lateness is the time
    from a step's deadline to its completion, 0 if it was completed in time. Waiting can be
    interrupted.

    Args:
        grid: the communication points.
        factor: simulated seconds per second of wall time.
        late: reaction to a step that is more than one step late.
    """

    def __init__(self, grid: TimeGrid, factor: float, late: LatePolicy):
        self._grid, self._factor, self._late = grid, factor, late
        interval = grid.step * 10**9 / Fraction(factor)
        self._numerator, self._denominator = interval.numerator, interval.denominator
        self._lateness = array("q")
        self._warned = False
        self._start = 0

    def start(self, n: int = 0) -> None:
        """Set the deadline of communication point `n` to the current time."""
        self._start = time.monotonic_ns() - n * self._numerator // self._denominator

    def wait(self, n: int) -> None:
        """Wait until communication point `n` is due.

        Raises:
            LateError: the point was due more than one step ago and `late` is "fail".
        """
        due = self._start + n * self._numerator // self._denominator
        ahead = due - time.monotonic_ns()
        self._lateness.append(max(0, -ahead))
        if ahead > 0:
            while (ahead := due - time.monotonic_ns()) > 0:
                time.sleep(min(ahead, _LONGEST_SLEEP) * 1e-9)
        elif -ahead * self._denominator > self._numerator:
            self._report_lateness(n, -ahead * 1e-9)

    def _report_lateness(self, n: int, late: float) -> None:
        step = float(self._grid.step) / self._factor
        text = (
            f"t = {self._grid.time_at(n):.12g} s was reached {late:.3g} s late, more than one step "
            f"({step:.3g} s)"
        )
        if self._late == "fail":
            raise LateError(f"too slow for {self._factor:g} times real time: {text}")
        if not self._warned:
            self._warned = True
            component_log.log_message(
                "real time",
                component_log.WARNING,
                f"{text}; reported once, the summary of the run counts all late steps",
            )

    def statistics(self) -> dict[str, Any]:
        """Return the factor, the number of steps and of late steps, and the lateness (s).

        Maximum, mean, 99 % quantile.
        """
        lateness = np.array(self._lateness, np.float64) * 1e-9 if self._lateness else np.zeros(1)
        return {
            "factor": self._factor,
            "steps": len(self._lateness),
            "late_steps": int(np.count_nonzero(lateness)),
            "max_lateness": float(lateness.max()),
            "mean_lateness": float(lateness.mean()),
            "lateness_99_percent": float(np.percentile(lateness, 99)),
        }


class Stopwatch:
    """Accumulated wall time (s) by name of the measured part."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def measure(self, part: str) -> Iterator[None]:
        """Add the duration of the block to `part`, also if the block raises."""
        began = perf_counter()
        try:
            yield
        finally:
            self.add(part, perf_counter() - began)

    def add(self, part: str, seconds: float) -> None:
        """Add a duration (s) to `part`."""
        self.seconds[part] = self.seconds.get(part, 0.0) + seconds
