"""A system compiled once into flat arrays: who steps when, and which value goes where before that.

Stages become phases: first the whole stage reads what comes from outside, then its components step; since everything was
read before, the order inside a stage has no influence (Jacobi), and one component per stage is Gauss-Seidel. A group (nested
system) reads its outside values with its stage and then runs phases of its own.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from ..component import Component, Variable
from ..system import Connection, Endpoint, Group, Parallel, Stage, System, members
from ..timing import Grid
from .layout import Layout, Slot, lay_out


@dataclass(frozen=True, eq=False)
class Gather:
    """Values of one dtype that move together: target = factor * source + offset, `delay` macro steps late."""

    source: np.ndarray
    source_indices: np.ndarray
    target: np.ndarray
    target_indices: np.ndarray
    delay: int = 0
    factor: np.ndarray | None = None
    offset: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Step:
    """One component's turn: every `divisor` macro steps it advances by `step_size` (s)."""

    name: str
    component: Component
    divisor: int
    step_size: float


@dataclass(frozen=True, eq=False)
class Phase:
    """Gathers, then steps."""

    gathers: tuple[Gather, ...]
    steps: tuple[Step, ...]
    parallel: Parallel = "auto"


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything an executor needs."""

    system: System
    grid: Grid
    inputs: Layout
    signals: Layout
    phases: Sequence[Phase]


def compile_plan(system: System, grid: Grid, recorded: Iterable[Endpoint] = ()) -> Plan:
    """Lay out the arrays and order the work. The system must have no problems, its periods must fit the grid."""
    phases = list(_phases(system))
    inputs = _inputs(system, [connection for connections, _, _ in phases for connection in connections])
    signals = _signals(system, recorded)
    gathering = _Gathering(system, inputs, signals)
    return Plan(
        system,
        grid,
        inputs,
        signals,
        [
            Phase(tuple(gathering.gathers(connections)), tuple(_step(system, grid, name) for name in names), parallel)
            for connections, names, parallel in phases
        ],
    )


def _step(system: System, grid: Grid, name: str) -> Step:
    divisor = int(system.periods.get(name, grid.step) / grid.step)
    return Step(name, system.components[name], divisor, float(grid.step * divisor))


_RawPhase = tuple[list[Connection], list[str], Parallel]


def _phases(system: System) -> Iterator[_RawPhase]:
    """(connections to read, components to step, whether at the same time) of every phase, in order."""
    incoming: dict[str, list[Connection]] = defaultdict(list)
    for connection in system.connections:
        incoming[connection.target.component].append(connection)
    yield from _run(system.stages, system.parallel, frozenset(system.components), incoming)


def _run(
    stages: Sequence[Stage], parallel: Parallel, inside: frozenset[str], incoming: Mapping[str, Sequence[Connection]]
) -> Iterator[_RawPhase]:
    """Phases of stages whose members read from `inside` now; everything else was read before."""
    for stage in stages:
        groups = [member for member in stage if isinstance(member, Group)]
        own_group = {name: frozenset(members(group.stages)) for group in groups for name in members(group.stages)}
        readers = [connection for name in members([stage]) for connection in incoming.get(name, ())]
        yield (
            [
                c
                for c in readers
                if c.source.component in inside and c.source.component not in own_group.get(c.target.component, ())
            ],
            [member for member in stage if not isinstance(member, Group)],
            parallel,
        )
        for group in groups:
            yield from _run(group.stages, group.parallel, frozenset(members(group.stages)), incoming)


def _inputs(system: System, connections: Iterable[Connection]) -> Layout:
    """Inputs in the order in which they are gathered, so that what is gathered together lies together."""
    wanted: dict[str, dict[str, Variable]] = {name: {} for name in members(system.stages)}
    for connection in connections:
        variable = system.place(connection.target).variable
        wanted[connection.target.component].setdefault(variable.name, variable)
    for name in wanted:
        if system.components[name].binds_everything:
            wanted[name] = {v.name: v for v in system.components[name].variables if v.causality == "input"}
    return lay_out({name: list(variables.values()) for name, variables in wanted.items()})


def _signals(system: System, recorded: Iterable[Endpoint]) -> Layout:
    """Every output that something reads."""
    read: dict[str, set[str]] = {name: set() for name in members(system.stages)}
    for endpoint in (*(c.source for c in system.connections), *recorded):
        read[endpoint.component].add(system.place(endpoint).variable.name)
    return lay_out(
        {
            name: [
                variable
                for variable in system.components[name].variables
                if variable.name in names or (system.components[name].binds_everything and variable.causality == "output")
            ]
            for name, names in read.items()
        }
    )


def conversion(source: Variable, target: Variable) -> tuple[float, float]:
    """(factor, offset) from the source's unit to the target's; (1.0, 0.0) where one of them has no unit."""
    if source.unit is None or target.unit is None:
        return 1.0, 0.0
    return source.unit.conversion(target.unit)


class _Gathering:
    """Makes gathers out of connections, as few and as long as possible."""

    def __init__(self, system: System, inputs: Layout, signals: Layout):
        self._system, self._inputs, self._signals = system, inputs, signals
        #: (dtype of source, place of target) -> offset of source, for all connections that just copy
        self._copies: dict[tuple[Any, Slot], int] = {}
        for connection in system.connections:
            if not connection.delay and self._conversion(connection) == (1.0, 0.0):
                source, target = self._ends(connection)
                self._copies[source.dtype, target] = source.offset

    def _ends(self, connection: Connection) -> tuple[Slot, Slot]:
        return self._signals.places[connection.source], self._inputs.places[connection.target]

    def _conversion(self, connection: Connection) -> tuple[float, float]:
        return conversion(self._system.place(connection.source).variable, self._system.place(connection.target).variable)

    def gathers(self, connections: Iterable[Connection]) -> Iterator[Gather]:
        """The gathers of one phase, by dtypes, delay, and with or without conversion."""
        kinds: dict[tuple[Any, ...], list[Connection]] = defaultdict(list)
        for connection in connections:
            source, target = self._ends(connection)
            converted = self._conversion(connection) != (1.0, 0.0)
            kinds[source.dtype, target.dtype, connection.delay, converted].append(connection)
        for (_, _, delay, converted), alike in kinds.items():
            if delay or converted:
                yield self._special(alike, delay, converted)
            else:
                yield from self._runs(alike)

    def _special(self, connections: list[Connection], delay: int, converted: bool) -> Gather:
        sources, targets = zip(*map(self._ends, connections), strict=True)
        factors, offsets = np.array([self._conversion(connection) for connection in connections]).T
        return self._gather(sources, targets, delay, *((factors, offsets) if converted else ()))

    def _runs(self, connections: list[Connection]) -> Iterator[Gather]:
        """Copies, joined to runs of neighbouring targets.

        A gap is filled with the copies that belong there although they are read again later, in the phase they belong to: one
        long gather costs less than two short ones.
        """
        source_dtype, target_dtype = (slot.dtype for slot in self._ends(connections[0]))
        offsets = sorted(self._ends(connection)[1].offset for connection in connections)
        runs = [[offsets[0]]]
        for before, after in pairwise(offsets):
            gap = range(before + 1, after)
            if all((source_dtype, Slot(target_dtype, offset)) in self._copies for offset in gap):
                runs[-1] += [*gap, after]
            else:
                runs.append([after])
        for run in runs:
            targets = [Slot(target_dtype, offset) for offset in run]
            yield self._gather([Slot(source_dtype, self._copies[source_dtype, target]) for target in targets], targets)

    def _gather(self, sources: Sequence[Slot], targets: Sequence[Slot], *more: Any) -> Gather:
        return Gather(
            self._signals.arrays[sources[0].dtype],
            np.array([slot.offset for slot in sources], np.intp),
            self._inputs.arrays[targets[0].dtype],
            np.array([slot.offset for slot in targets], np.intp),
            *more,
        )
