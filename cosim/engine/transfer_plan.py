"""Transfers of output values to inputs: their plan, and calls that perform them in Python.

Connections of one phase between values of the same types are grouped into few transfers, each of
which copies many values at once by arrays of indices. The native executor copies them in C. The
pure Python executor calls functions that copy contiguous runs as memory, few values one by one, and
others with NumPy.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from ..core.component import Variable
from ..core.system import Connection, Endpoint, System
from .layout import ArrayPosition, Dtype, Layout


@dataclass(frozen=True, eq=False)
class Transfer:
    """Values of one dtype that are copied together.

    Target = factor * source + offset, `delay` macro steps late.

    Without `factor` and `offset` the values are copied, and converted to the dtype of the target.
    `source_indices` has the shape (values,), or (terms, values) for sums of terms.

    With `slope_indices` the inputs change linearly within the next step of `step_size` (s): the
    slope of the output since the last transfer is stored at these indices of `target`. The values
    are those of the last transfer if the output already has its value of the end of the step
    (`interpolates`). The delay is then 1. Slopes that the source gives are plain transfers.
    """

    source: np.ndarray
    source_indices: np.ndarray
    target: np.ndarray
    target_indices: np.ndarray
    delay: int = 0
    factor: np.ndarray | None = None
    offset: np.ndarray | None = None
    slope_indices: np.ndarray | None = None
    interpolates: bool = False
    step_size: float = 0.0

    @property
    def term_count(self) -> int:
        """Number of source values that are added to each target value.

        0: the transfer makes no sums.
        """
        return len(self.source_indices) if self.source_indices.ndim == 2 else 0


def term_endpoint(connection: Connection) -> Endpoint:
    """Return the name of the value of one term of a sum in the layout of the inputs.

    No component has the name "".
    """
    return Endpoint("", f"{connection.target}+{connection.term}")


def slope_variable(variable: Variable) -> Variable:
    """Return the variable with the time derivative of an input or output."""
    return Variable(
        f"slope of {variable.name}",
        causality=variable.causality,
        shape=variable.shape,
        derivative_of=variable.name,
    )


def slope_endpoint(system: System, end: Endpoint) -> Endpoint:
    """Return the name of the time derivative of an input or output in its layout."""
    variable, element = system.find_element(end)
    return Endpoint(end.component, slope_variable(variable).scalar_names[element])


def unit_conversion(source: Variable, target: Variable) -> tuple[float, float]:
    """Return (factor, offset) from the source's unit to the target's unit.

    (1.0, 0.0) if one of them has no unit.

    A relative quantity has no offset (FMI 2.0 section 2.2.3, FMI 3.0 section 2.4.4:
    relativeQuantity).
    """
    if source.unit is None or target.unit is None:
        return 1.0, 0.0
    factor, offset = source.unit.conversion(target.unit)
    return factor, 0.0 if source.relative_quantity or target.relative_quantity else offset


def connection_conversion(system: System, connection: Connection) -> tuple[float, float]:
    """Return (factor, offset) of the conversion of units and the connection's gain and offset."""
    ends = (connection.source, connection.target)
    factor, offset = unit_conversion(*(system.find_element(end).variable for end in ends))
    return connection.gain * factor, connection.gain * offset + connection.offset


class TransferPlanner:
    """Groups connections into as few and as long transfers as possible.

    The inputs lie in memory in the order in which they are read, so plain copies of one phase have
    targets that are mostly consecutive. A gap between them is filled if the inputs in it are only
    read in later phases: they get their present values, and the right ones in their own phase.
    Conversions, delays, slopes and sums are transfers of their own.

    Args:
        system: its connections and variables.
        inputs: layout of the inputs.
        outputs: layout of the outputs.
        step_size: size of a macro step (s).
    """

    def __init__(self, system: System, inputs: Layout, outputs: Layout, step_size: float):
        self._system, self._inputs, self._outputs, self._step_size = (
            system,
            inputs,
            outputs,
            step_size,
        )
        #: (dtype of source, position of target) -> offset of source, for connections without delay
        #: and conversion
        self._copies: dict[tuple[Dtype, ArrayPosition], int] = {}
        for connection in system.connections:
            is_copy = not connection.delay and connection.interpolation == "hold"
            if is_copy and self._conversion(connection) == (1.0, 0.0):
                source, target = self._positions(connection)
                self._copies[source.dtype, target] = source.offset
        #: terms of each sum, in order
        self._terms: dict[Endpoint, list[Connection]] = defaultdict(list)
        for connection in system.connections:
            if connection.term:
                self._terms[connection.target].append(connection)
        #: targets of the connections of this phase and of earlier ones, which must not be
        #: overwritten with newer values
        self._targets_read: set[ArrayPosition] = set()

    def _positions(self, connection: Connection) -> tuple[ArrayPosition, ArrayPosition]:
        target = term_endpoint(connection) if connection.term else connection.target
        return self._outputs.positions[connection.source], self._inputs.positions[target]

    def _conversion(self, connection: Connection) -> tuple[float, float]:
        return connection_conversion(self._system, connection)

    def plan_transfers(
        self, connections: Iterable[Connection], stepped: Set[str] = frozenset()
    ) -> Iterator[Transfer]:
        """Yield the transfers of one phase, grouped by dtypes, delay and conversion.

        Then the sums of the transferred terms.

        Args:
            connections: those that are read in this phase; call this method in the order of the
                phases.
            stepped: components that have already made the present macro step.
        """
        connections = list(connections)
        self._targets_read |= {self._positions(connection)[1] for connection in connections}
        groups: dict[tuple[Dtype, Dtype, int, bool], list[Connection]] = defaultdict(list)
        yield from self._linear_transfers(
            [c for c in connections if c.interpolation == "linear"], stepped
        )
        for connection in connections:
            if connection.interpolation != "hold":
                continue
            source, target = self._positions(connection)
            converted = self._conversion(connection) != (1.0, 0.0)
            groups[source.dtype, target.dtype, connection.delay, converted].append(connection)
        for (_, _, delay, converted), group in groups.items():
            if delay or converted:
                yield self._delayed_or_converted(group, delay, converted)
            else:
                yield from self._contiguous_copies(group)
        yield from self._sums(
            dict.fromkeys(connection.target for connection in connections if connection.term)
        )

    def _sums(self, targets: Iterable[Endpoint]) -> Iterator[Transfer]:
        """Yield transfers that add up the terms of these inputs, by dtype and number of terms."""
        groups: dict[tuple[Dtype, int], list[Endpoint]] = defaultdict(list)
        for target in targets:
            groups[self._inputs.positions[target].dtype, len(self._terms[target])].append(target)
        for (dtype, _), group in groups.items():
            offsets = []
            for target in group:
                sources = [self._inputs.positions[term_endpoint(t)] for t in self._terms[target]]
                offsets.append([position.offset for position in sources])
            yield Transfer(
                self._inputs.arrays[sources[0].dtype],
                np.ascontiguousarray(np.transpose(offsets), np.intp),
                self._inputs.arrays[dtype],
                np.array([self._inputs.positions[target].offset for target in group], np.intp),
            )

    def _linear_transfers(
        self, connections: Sequence[Connection], stepped: Set[str]
    ) -> Iterator[Transfer]:
        """Yield the transfers of values and slopes.

        Slopes that the source gives, else those of the line through two values.
        """
        given = [
            c
            for c in connections
            if c.source.component not in stepped
            and slope_endpoint(self._system, c.source) in self._outputs.positions
        ]
        if given:
            yield self._delayed_or_converted(given, 0, True)
            sources = [slope_endpoint(self._system, c.source) for c in given]
            targets = [slope_endpoint(self._system, c.target) for c in given]
            factor = np.array([self._conversion(connection)[0] for connection in given])
            yield self._make_transfer(
                [self._outputs.positions[source] for source in sources],
                [self._inputs.positions[target] for target in targets],
                0,
                factor,
                np.zeros_like(factor),
            )
        for interpolates in (False, True):
            rest = [
                c
                for c in connections
                if (c.source.component in stepped) == interpolates and c not in given
            ]
            if rest:
                yield self._linear_transfer(rest, interpolates)

    def _linear_transfer(self, connections: Sequence[Connection], interpolates: bool) -> Transfer:
        converted = any(self._conversion(connection) != (1.0, 0.0) for connection in connections)
        slopes = [
            self._inputs.positions[slope_endpoint(self._system, connection.target)].offset
            for connection in connections
        ]
        plain = self._delayed_or_converted(list(connections), 1, converted)
        return replace(
            plain,
            slope_indices=np.array(slopes, np.intp),
            interpolates=interpolates,
            step_size=self._step_size,
        )

    def _delayed_or_converted(
        self, connections: list[Connection], delay: int, converted: bool
    ) -> Transfer:
        sources, targets = zip(*map(self._positions, connections), strict=True)
        if not converted:
            return self._make_transfer(sources, targets, delay)
        factor, offset = np.ascontiguousarray(
            np.transpose([self._conversion(connection) for connection in connections])
        )
        return self._make_transfer(sources, targets, delay, factor, offset)

    def _contiguous_copies(self, connections: list[Connection]) -> Iterator[Transfer]:
        """Yield plain copies with consecutive targets.

        A gap between targets is filled with connections of later phases, which are copied again in
        their own phase: one long transfer costs less than two short ones.
        """
        source_dtype, target_dtype = (
            position.dtype for position in self._positions(connections[0])
        )
        offsets = sorted(self._positions(connection)[1].offset for connection in connections)
        runs = [[offsets[0]]]
        for before, after in pairwise(offsets):
            gap = [ArrayPosition(target_dtype, offset) for offset in range(before + 1, after)]
            if all(
                (source_dtype, target) in self._copies and target not in self._targets_read
                for target in gap
            ):
                runs[-1] += range(before + 1, after + 1)
            else:
                runs.append([after])
        for run in runs:
            targets = [ArrayPosition(target_dtype, offset) for offset in run]
            yield self._make_transfer(
                [
                    ArrayPosition(source_dtype, self._copies[source_dtype, target])
                    for target in targets
                ],
                targets,
            )

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


TransferCall = Callable[[], object]

#: number of values, or of contiguous runs, up to which copying one by one is faster than NumPy
MAX_SINGLE_COPIES = 4


def contiguous_views(transfer: Transfer) -> list[tuple[memoryview, memoryview]] | None:
    """Return (target, source) views of every contiguous run.

    None for many runs and for transfers that are not plain copies.
    """
    if (
        transfer.delay
        or transfer.factor is not None
        or transfer.source.dtype != transfer.target.dtype
        or transfer.source.dtype.hasobject
        or transfer.term_count
    ):
        return None
    targets, sources = transfer.target_indices, transfer.source_indices
    breaks = np.flatnonzero((np.diff(targets) != 1) | (np.diff(sources) != 1)) + 1
    runs = [slice(begin, end) for begin, end in pairwise([0, *breaks.tolist(), len(targets)])]
    if len(runs) > MAX_SINGLE_COPIES:
        return None
    return [
        (
            _contiguous_view(transfer.target, targets[run]),
            _contiguous_view(transfer.source, sources[run]),
        )
        for run in runs
    ]


def _contiguous_view(array: np.ndarray, indices: np.ndarray) -> memoryview:
    return array[indices[0] : indices[-1] + 1].data


def compile_transfer(transfer: Transfer) -> TransferCall:
    """Return a function that performs the transfer without its delay, and allocates little."""
    if transfer.term_count:
        return partial(_add_terms, transfer)
    first, count = int(transfer.target_indices[0]), len(transfer.target_indices)
    is_contiguous = np.array_equal(transfer.target_indices, np.arange(first, first + count))
    if (
        count <= MAX_SINGLE_COPIES
        and transfer.factor is None
        and _is_safe_cast(transfer.source.dtype, transfer.target.dtype)
    ):
        indices = list(
            zip(transfer.target_indices.tolist(), transfer.source_indices.tolist(), strict=True)
        )
        return partial(_copy_items, transfer.target.data, transfer.source.data, indices)
    if (
        transfer.factor is not None
        or transfer.source.dtype != transfer.target.dtype
        or not is_contiguous
    ):
        return partial(_scatter, transfer, transfer.source, transfer.source_indices)
    return partial(
        transfer.source.take,
        transfer.source_indices,
        None,
        transfer.target[first : first + count],
        "clip",
    )


def _is_safe_cast(source: np.dtype[Any], target: np.dtype[Any]) -> bool:
    """Return whether a memoryview of dtype `target` accepts every value of dtype `source`."""
    return not source.hasobject and (
        target.kind == "b" or bool(np.can_cast(source, target, "safe"))
    )


def _copy_items(target: memoryview, source: memoryview, indices: Sequence[tuple[int, int]]) -> None:
    for i, j in indices:
        target[i] = source[j]


def _scatter(transfer: Transfer, source: np.ndarray, indices: np.ndarray) -> None:
    values: Any = source[indices]
    if transfer.factor is not None:
        values = transfer.factor * values + transfer.offset
    transfer.target[transfer.target_indices] = values


def _add_terms(transfer: Transfer) -> None:
    first, *others = transfer.source_indices
    values = transfer.source[first]
    for indices in others:
        values += transfer.source[indices]
    transfer.target[transfer.target_indices] = values


class DelayLine:
    """Ring buffer of a delayed or linear transfer.

    During the first `delay` macro steps it delivers the initial outputs.
    """

    def __init__(self, transfer: Transfer):
        self.transfer = transfer
        #: source values, shape (delay, values)
        self.ring = np.empty((transfer.delay, len(transfer.source_indices)), transfer.source.dtype)
        #: duration to which the slopes of a linear transfer belong (s)
        self.step_size = transfer.step_size
        self._oldest = 0
        self._all = np.arange(len(transfer.source_indices))

    def fill(self) -> None:
        """Fill all rows with the current source values."""
        self.ring[:] = self.transfer.source[self.transfer.source_indices]

    def shorten_step(self, step_size: float | None) -> None:
        """Set the size of the present step (s), to which slopes between its ends belong.

        None: it is not shorter.
        """
        if self.transfer.interpolates:
            self.step_size = step_size or self.transfer.step_size

    def restore(self, ring: np.ndarray) -> None:
        """Restore a copy of the ring in which the oldest row comes first."""
        self.ring[:], self._oldest = ring, 0

    def align_ring(self, transfers: int) -> None:
        """Rotate the ring so that the oldest row comes first.

        The native executor has made `transfers` transfers.
        """
        self.ring[:] = np.roll(self.ring, -(self._oldest + transfers), 0)
        self._oldest = 0

    def deliver_line(self) -> None:
        """Deliver values and slopes of a linear transfer; store no source values."""
        transfer, (before,) = self.transfer, self.ring
        now = transfer.source[transfer.source_indices]
        slopes = (now - before) / self.step_size
        transfer.target[transfer.slope_indices] = (
            slopes if transfer.factor is None else transfer.factor * slopes
        )
        _scatter(transfer, before if transfer.interpolates else now, self._all)

    def apply(self) -> None:
        """Deliver the oldest values and replace them by the current source values."""
        oldest = self.ring[self._oldest]
        if self.transfer.slope_indices is None:
            _scatter(self.transfer, oldest, self._all)
        else:
            self.deliver_line()
        oldest[:] = self.transfer.source[self.transfer.source_indices]
        self._oldest = (self._oldest + 1) % len(self.ring)
