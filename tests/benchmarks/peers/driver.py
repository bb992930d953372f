"""Common part of the peers' drivers: the ring, the clock and the output.

    python ring_PEER.py FMU SIZE STEPS

steps a ring of SIZE instances of a lag: output y1 of each feeds input u1 of the next, the step size
is 0.01 s, one value is recorded. It prints one line of JSON: CPU and wall time (us) per step, and
the last value. A correct importer ends at 1; without propagation of the initial outputs the value
is 0.98.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

STEP = 0.01


@dataclass(frozen=True)
class Ring:
    """A ring of `size` instances of `fmu`."""

    fmu: str
    size: int
    steps: int

    @property
    def names(self) -> list[str]:
        return [f"s{i}" for i in range(self.size)]

    @property
    def pairs(self) -> list[tuple[str, str]]:
        """(from, to) of every connection."""
        return list(zip(self.names, [*self.names[1:], *self.names[:1]], strict=True))


class Clock:
    """CPU time of the process (all threads) and wall time of a `with` block (s)."""

    def __enter__(self) -> Clock:
        self._wall, self._cpu = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_: Any) -> None:
        self.cpu = time.process_time() - self._cpu
        self.wall = time.perf_counter() - self._wall


#: CPU time (s), wall time (s), last value
Outcome = tuple[float, float, float]


def time_whole_runs(simulate: Callable[[int], float], steps: int) -> Outcome:
    """Measure an importer that only offers whole runs: the difference of a long and a short run, so
    that the start cancels.

    The long run has twice the steps, since the start of a large ring takes longer than its steps,
    and its duration varies.
    """
    simulate(2)  # imports and caches
    with Clock() as short:
        simulate(2)
    with Clock() as long:
        last = simulate(2 + 2 * steps)
    return (long.cpu - short.cpu) / 2, (long.wall - short.wall) / 2, last


def main(run: Callable[[Ring], Outcome]) -> None:
    ring = Ring(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
    cpu, wall, last = run(ring)
    print(
        json.dumps({"cpu": cpu / ring.steps * 1e6, "wall": wall / ring.steps * 1e6, "last": last}),
        flush=True,
    )
