"""Recording into preallocated blocks: one per dtype, one row per recorded communication point."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..recording import Recording
from ..system import Endpoint
from .plan import Plan


class Recorder:
    """Keeps the values of `columns` (recorded name -> output) at every `every`-th communication point."""

    def __init__(self, plan: Plan, columns: Mapping[str, Endpoint], every: int = 1):
        self._plan, self._columns, self._every = plan, columns, every
        self.rows = 0
        capacity = plan.grid.count // every + 1
        names: dict[np.dtype[Any], list[str]] = defaultdict(list)
        for name, endpoint in columns.items():
            names[plan.signals.places[endpoint].dtype].append(name)
        self._names = dict(names)
        self._blocks = {dtype: np.empty((capacity, len(group)), dtype) for dtype, group in names.items()}
        self._takes = [
            (
                plan.signals.arrays[dtype].take,
                np.array([plan.signals.places[columns[name]].offset for name in group], np.intp),
                self._blocks[dtype],
            )
            for dtype, group in names.items()
        ]

    def record(self, n: int) -> None:
        """Keep the present values as those of communication point n, if it is one to be recorded."""
        if n % self._every:
            return
        row = self.rows
        for take, indices, block in self._takes:
            take(indices, None, block[row], "clip")
        self.rows = row + 1

    def recording(self) -> Recording:
        """Everything recorded so far; columns in the order they were asked for."""
        columns = {
            name: self._blocks[dtype][: self.rows, i] for dtype, group in self._names.items() for i, name in enumerate(group)
        }
        places = {name: self._plan.system.place(endpoint).variable for name, endpoint in self._columns.items()}
        booleans = {name for name, variable in places.items() if variable.type == "Boolean"}
        return Recording(
            np.array([self._plan.grid.seconds(row * self._every) for row in range(self.rows)]),
            {name: columns[name].astype(bool) if name in booleans else columns[name] for name in self._columns},
            {name: variable.unit.name if variable.unit else "" for name, variable in places.items()},
        )
