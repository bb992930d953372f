"""Which values move together, and how: connections become gathers."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.component import Variable
from ..core.system import Connection, System
from .layout import ArrayPosition, Dtype, Layout


@dataclass(frozen=True, eq=False)
class Transfer:
    """Values of one dtype that move together: target = factor * source + offset, `delay` macro steps late."""

    source: np.ndarray
    source_indices: np.ndarray
    target: np.ndarray
    target_indices: np.ndarray
    delay: int = 0
    factor: np.ndarray | None = None
    offset: np.ndarray | None = None


def unit_conversion(source: Variable, target: Variable) -> tuple[float, float]:
    """(factor, offset) from the source's unit to the target's; (1.0, 0.0) where one of them has no unit.

    Differences have no offset (FMI 2.0 section 2.2.3, FMI 3.0 section 2.4.4: relativeQuantity).
    """
    if source.unit is None or target.unit is None:
        return 1.0, 0.0
    factor, offset = source.unit.conversion(target.unit)
    return factor, 0.0 if source.relative_quantity or target.relative_quantity else offset


class TransferPlanner:
    """Makes gathers out of connections, as few and as long as possible."""

    def __init__(self, system: System, inputs: Layout, signals: Layout):
        self._system, self._inputs, self._signals = system, inputs, signals
        #: (dtype of source, place of target) -> offset of source, for all connections that just copy
        self._copies: dict[tuple[Dtype, ArrayPosition], int] = {}
        for connection in system.connections:
            if not connection.delay and self._unit_conversion(connection) == (1.0, 0.0):
                source, target = self._positions(connection)
                self._copies[source.dtype, target] = source.offset
        #: targets of the phases so far: what they read earlier on purpose is not read again
        self._targets_read: set[ArrayPosition] = set()

    def _positions(self, connection: Connection) -> tuple[ArrayPosition, ArrayPosition]:
        return self._signals.positions[connection.source], self._inputs.positions[connection.target]

    def _unit_conversion(self, connection: Connection) -> tuple[float, float]:
        return unit_conversion(
            self._system.find_element(connection.source).variable, self._system.find_element(connection.target).variable
        )

    def plan_transfers(self, connections: Iterable[Connection]) -> Iterator[Transfer]:
        """The gathers of one phase, by dtypes, delay, and with or without conversion. Phases come in order."""
        connections = list(connections)
        self._targets_read |= {self._positions(connection)[1] for connection in connections}
        kinds: dict[tuple[Any, ...], list[Connection]] = defaultdict(list)
        for connection in connections:
            source, target = self._positions(connection)
            converted = self._unit_conversion(connection) != (1.0, 0.0)
            kinds[source.dtype, target.dtype, connection.delay, converted].append(connection)
        for (_, _, delay, converted), alike in kinds.items():
            if delay or converted:
                yield self._delayed_or_converted(alike, delay, converted)
            else:
                yield from self._contiguous_copies(alike)

    def _delayed_or_converted(self, connections: list[Connection], delay: int, converted: bool) -> Transfer:
        sources, targets = zip(*map(self._positions, connections), strict=True)
        both = np.ascontiguousarray(np.transpose([self._unit_conversion(connection) for connection in connections]))
        return self._make_transfer(sources, targets, delay, *(both if converted else ()))

    def _contiguous_copies(self, connections: list[Connection]) -> Iterator[Transfer]:
        """Copies, joined to runs of neighbouring targets.

        A gap is filled with the copies that belong there although they are read again later, in the phase they belong to: one
        long gather costs less than two short ones.
        """
        source_dtype, target_dtype = (slot.dtype for slot in self._positions(connections[0]))
        offsets = sorted(self._positions(connection)[1].offset for connection in connections)
        runs = [[offsets[0]]]
        for before, after in pairwise(offsets):
            gap = range(before + 1, after)
            if all(self._may_be_read_early(source_dtype, ArrayPosition(target_dtype, offset)) for offset in gap):
                runs[-1] += [*gap, after]
            else:
                runs.append([after])
        for run in runs:
            targets = [ArrayPosition(target_dtype, offset) for offset in run]
            yield self._make_transfer(
                [ArrayPosition(source_dtype, self._copies[source_dtype, target]) for target in targets], targets
            )

    def _may_be_read_early(self, source_dtype: Dtype, target: ArrayPosition) -> bool:
        return (source_dtype, target) in self._copies and target not in self._targets_read

    def _make_transfer(self, sources: Sequence[ArrayPosition], targets: Sequence[ArrayPosition], *more: Any) -> Transfer:
        return Transfer(
            self._signals.arrays[sources[0].dtype],
            np.array([slot.offset for slot in sources], np.intp),
            self._inputs.arrays[targets[0].dtype],
            np.array([slot.offset for slot in targets], np.intp),
            *more,
        )
