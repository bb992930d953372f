"""What the drivers of the peers have in common: the ring, the clock and the answer.

    python ring_PEER.py FMU SIZE STEPS

steps a ring of SIZE instances of a lag (output y1 of each feeds input u1 of the next, step 0.01 s, one value recorded) and prints
one line of JSON: CPU and wall microseconds per step, and the last value, which is 1 when the importer is right: with
outputs not propagated before the first step it is 0.98.
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
    """CPU time of the process, all threads together, and wall time, of what happens inside (s)."""

    def __enter__(self) -> Clock:
        self._wall, self._cpu = time.perf_counter(), time.process_time()
        return self

    def __exit__(self, *_: Any) -> None:
        self.cpu = time.process_time() - self._cpu
        self.wall = time.perf_counter() - self._wall


#: seconds of CPU, seconds of wall time, last value
Outcome = tuple[float, float, float]


def time_whole_runs(simulate: Callable[[int], float], steps: int) -> Outcome:
    """For importers that only run as a whole: what all steps but the first two cost, so that the start cancels.

    They are made twice over, since the start of a large ring takes longer than its steps and scatters.
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
    print(json.dumps({"cpu": cpu / ring.steps * 1e6, "wall": wall / ring.steps * 1e6, "last": last}), flush=True)
