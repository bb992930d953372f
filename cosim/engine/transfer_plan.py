"""Grouping of connections into transfers, which copy many values at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..core.component import Variable
from ..core.system import Connection, System
from .layout import ArrayPosition, Dtype, Layout


@dataclass(frozen=True, eq=False)
class Transfer:
    """Values of one dtype that are copied together: target = factor * source + offset, `delay` macro steps late.

    Without `factor` and `offset` the values are copied, and converted to the dtype of the target.
    """

    source: np.ndarray
    source_indices: np.ndarray
    target: np.ndarray
    target_indices: np.ndarray
    delay: int = 0
    factor: np.ndarray | None = None
    offset: np.ndarray | None = None


def unit_conversion(source: Variable, target: Variable) -> tuple[float, float]:
    """Return (factor, offset) from the source's unit to the target's unit; (1.0, 0.0) if one of them has no unit.

    A relative quantity has no offset (FMI 2.0 section 2.2.3, FMI 3.0 section 2.4.4: relativeQuantity).
    """
    if source.unit is None or target.unit is None:
        return 1.0, 0.0
    factor, offset = source.unit.conversion(target.unit)
    return factor, 0.0 if source.relative_quantity or target.relative_quantity else offset


class TransferPlanner:
    """Groups connections into as few and as long transfers as possible.

    Args:
        system: its connections and variables.
        inputs: layout of the inputs.
        outputs: layout of the outputs.
    """

    def __init__(self, system: System, inputs: Layout, outputs: Layout):
        self._system, self._inputs, self._outputs = system, inputs, outputs
        #: (dtype of source, position of target) -> offset of source, for connections without delay and conversion
        self._copies: dict[tuple[Dtype, ArrayPosition], int] = {}
        for connection in system.connections:
            if not connection.delay and self._conversion(connection) == (1.0, 0.0):
                source, target = self._positions(connection)
                self._copies[source.dtype, target] = source.offset
        #: targets of the connections of this phase and of earlier ones, which must not be overwritten with newer values
        self._targets_read: set[ArrayPosition] = set()

    def _positions(self, connection: Connection) -> tuple[ArrayPosition, ArrayPosition]:
        return self._outputs.positions[connection.source], self._inputs.positions[connection.target]

    def _conversion(self, connection: Connection) -> tuple[float, float]:
        """Return (factor, offset) of the conversion of units, followed by the connection's own gain and offset."""
        factor, offset = unit_conversion(
            self._system.find_element(connection.source).variable, self._system.find_element(connection.target).variable
        )
        return connection.gain * factor, connection.gain * offset + connection.offset

    def plan_transfers(self, connections: Iterable[Connection]) -> Iterator[Transfer]:
        """Yield the transfers of one phase, grouped by dtypes, delay and conversion.

        Args:
            connections: those that are read in this phase; call this method in the order of the phases.
        """
        connections = list(connections)
        self._targets_read |= {self._positions(connection)[1] for connection in connections}
        groups: dict[tuple[Dtype, Dtype, int, bool], list[Connection]] = defaultdict(list)
        for connection in connections:
            source, target = self._positions(connection)
            converted = self._conversion(connection) != (1.0, 0.0)
            groups[source.dtype, target.dtype, connection.delay, converted].append(connection)
        for (_, _, delay, converted), group in groups.items():
            if delay or converted:
                yield self._delayed_or_converted(group, delay, converted)
            else:
                yield from self._contiguous_copies(group)

    def _delayed_or_converted(self, connections: list[Connection], delay: int, converted: bool) -> Transfer:
        sources, targets = zip(*map(self._positions, connections), strict=True)
        if not converted:
            return self._make_transfer(sources, targets, delay)
        factor, offset = np.ascontiguousarray(np.transpose([self._conversion(connection) for connection in connections]))
        return self._make_transfer(sources, targets, delay, factor, offset)

    def _contiguous_copies(self, connections: list[Connection]) -> Iterator[Transfer]:
        """Yield plain copies with consecutive targets.

        A gap between targets is filled with connections of later phases, which are copied again in their own phase: one long
        transfer costs less than two short ones.
        """
        source_dtype, target_dtype = (position.dtype for position in self._positions(connections[0]))
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

    def _make_transfer(
        self,
        sources: Sequence[ArrayPosition],
        targets: Sequence[ArrayPosition],
        delay: int = 0,
        factor: np.ndarray | None = None,
        offset: np.ndarray | None = None,
    ) -> Transfer:
        return Transfer(
            self._outputs.arrays[sources[0].dtype],
            np.array([position.offset for position in sources], np.intp),
            self._inputs.arrays[targets[0].dtype],
            np.array([position.offset for position in targets], np.intp),
            delay,
            factor,
            offset,
        )
