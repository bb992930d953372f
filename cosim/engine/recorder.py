"""Recording into preallocated blocks: one per dtype, one row per recorded communication point."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from ..recording import Recording
from ..system import Endpoint
from .layout import Dtype
from .plan import Plan


class Recorder:
    """Keeps the values of `columns` (recorded name -> output) at every `every`-th communication point."""

    def __init__(self, plan: Plan, columns: Mapping[str, Endpoint], every: int = 1):
        self._plan, self._columns, self._every = plan, columns, every
        self.rows = 0
        self._capacity = plan.grid.count // every + 1
        wanted: dict[Dtype, dict[str, int]] = defaultdict(dict)
        for name, endpoint in columns.items():
            slot = plan.signals.places[endpoint]
            wanted[slot.dtype][name] = slot.offset
        self._blocks: dict[Dtype, np.ndarray] = {}
        #: dtype -> name -> column in the block
        self._places: dict[Dtype, Mapping[str, int]] = {}
        self._keeps = [self._keep(dtype, offsets) for dtype, offsets in wanted.items()]

    def _keep(self, dtype: Dtype, offsets: Mapping[str, int]) -> Callable[[int], object]:
        """Lay out the block of a dtype; returns the function that keeps a row.

        A row is all signals when at least half of them are wanted (one copy of memory), else only the wanted ones.
        """
        signals = self._plan.signals.arrays[dtype]
        chosen = sorted(set(offsets.values()))
        whole = not dtype.hasobject and 2 * len(chosen) >= len(signals)
        width = len(signals) if whole else len(chosen)
        self._places[dtype] = offsets if whole else {name: chosen.index(offset) for name, offset in offsets.items()}
        block = self._blocks[dtype] = np.empty((self._capacity, width), dtype)
        if whole:
            return partial(_copy, block.data.cast("B"), signals.data.cast("B"))
        return partial(_choose, block, signals, np.array(chosen, np.intp))

    def record(self, n: int) -> None:
        """Keep the present values as those of communication point n, if it is one to be recorded."""
        if n % self._every:
            return
        for keep in self._keeps:
            keep(self.rows)
        self.rows += 1

    def recording(self) -> Recording:
        """Everything recorded so far; columns in the order they were asked for."""
        columns = {
            name: self._blocks[dtype][: self.rows, place]
            for dtype, places in self._places.items()
            for name, place in places.items()
        }
        variables = {name: self._plan.system.place(endpoint).variable for name, endpoint in self._columns.items()}
        booleans = {name for name, variable in variables.items() if variable.type == "Boolean"}
        return Recording(
            np.array([self._plan.grid.seconds(row * self._every) for row in range(self.rows)]),
            {name: columns[name].astype(bool) if name in booleans else columns[name] for name in self._columns},
            {name: variable.unit.name if variable.unit else "" for name, variable in variables.items()},
        )


def _copy(block: memoryview, signals: memoryview, row: int) -> None:
    size = len(signals)
    block[row * size : row * size + size] = signals


def _choose(block: np.ndarray, signals: np.ndarray, indices: np.ndarray, row: int) -> None:
    signals.take(indices, None, block[row], "clip")
