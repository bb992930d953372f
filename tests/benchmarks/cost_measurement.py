"""Costs of contenders, measured alternately, so that other load of the machine affects all of them
equally.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from operator import truediv
from statistics import median
from time import perf_counter, process_time

ROUNDS = 5

#: returns one measurement; CPU time per macro step (us) unless stated otherwise
Cost = Callable[[], float]


@dataclass(frozen=True)
class MedianCost:
    """Median cost, and the median of its ratios to the first contender of the same round."""

    name: str
    cost: float
    ratio: float


def measure_rounds(contenders: Mapping[str, Cost], rounds: int = ROUNDS) -> list[MedianCost]:
    """Measure all contenders once in every round; ratios refer to the first contender."""
    costs: dict[str, list[float]] = {name: [] for name in contenders}
    for _ in range(rounds):
        for name, cost in contenders.items():
            costs[name].append(cost())
    first = costs[next(iter(contenders))]
    medians = []
    for name, own in costs.items():
        ratio = median(map(truediv, own, first))
        medians.append(MedianCost(name, median(own), ratio))
    return medians


def print_heading(title: str, unit: str = "CPU us per step") -> None:
    print(
        f"\n{title}: median of {ROUNDS} alternating rounds, load average {os.getloadavg()[0]:.2f}"
    )
    print(f"  {'workload':24}{'contender':28}{unit:>16}{'ratio':>9}")


def print_rows(workload: str, rows: list[MedianCost]) -> dict[str, float]:
    """Print the rows of a workload and return the ratios."""
    for row in rows:
        print(f"  {workload:24}{row.name:28}{row.cost:16.4g}{row.ratio:9.3g}", flush=True)
    return {row.name: row.ratio for row in rows}


class Stopwatch:
    """Observer of a run that measures CPU time (of all threads) and wall time of the stepping loop
    (us per step).
    """

    def __init__(self) -> None:
        self._samples: list[tuple[int, float, float]] = []

    def __call__(self, finished: int, _count: int) -> None:
        self._samples.append((finished, process_time(), perf_counter()))

    @property
    def cpu(self) -> float:
        return self._per_step(1)

    @property
    def wall(self) -> float:
        return self._per_step(2)

    def _per_step(self, clock: int) -> float:
        first, last = self._samples[0], self._samples[-1]
        return (last[clock] - first[clock]) / (last[0] - first[0]) * 1e6
