"""A system compiled once into flat arrays: who steps when, and which value goes where before that.

Stages become phases: first the whole stage reads what comes from outside, then its components step; since everything was
read before, the order inside a stage has no influence (Jacobi), and one component per stage is Gauss-Seidel. A group (nested
system) reads its outside values with its stage and then runs phases of its own.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from ..core.component import Causality, Component, Variable
from ..core.system import Connection, Endpoint, Group, Iteration, Parallel, Stage, System, members
from ..core.time_grid import Grid
from .layout import Layout, lay_out
from .transfer_plan import Gather, Gathering


@dataclass(frozen=True, eq=False)
class Step:
    """One component's turn: every `divisor` macro steps it advances by `step_size` (s)."""

    name: str
    component: Component
    divisor: int
    step_size: float


@dataclass(frozen=True, eq=False)
class Phase:
    """Gathers, then steps, then a loop."""

    gathers: tuple[Gather, ...]
    steps: tuple[Step, ...]
    parallel: Parallel = "auto"
    loop: Loop | None = None


@dataclass(frozen=True, eq=False)
class Loop:
    """Phases that are repeated within a macro step until what their components tell each other stands still."""

    name: str
    iteration: Iteration
    phases: tuple[Phase, ...]
    connections: Sequence[Connection]

    @property
    def components(self) -> dict[str, Component]:
        """The components that step in it, by name."""
        return {step.name: step.component for phase in _opened(self.phases) for step in phase.steps}


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything an executor needs."""

    system: System
    grid: Grid
    inputs: Layout
    signals: Layout
    phases: Sequence[Phase]

    @property
    def all_phases(self) -> Iterator[Phase]:
        """The phases, each followed by those of its loop."""
        return _opened(self.phases)


def compile_plan(system: System, grid: Grid, recorded: Iterable[Endpoint] = ()) -> Plan:
    """Lay out the arrays and order the work. The system must have no problems, its periods must fit the grid."""
    phases = list(_phases(system))
    connections = [connection for phase in phases for connection in _read(phase)]
    inputs, signals = _inputs(system, connections), _signals(system, connections, recorded)
    gathering = Gathering(system, inputs, signals)

    def phase_of(raw: _RawPhase) -> Phase:
        steps = tuple(_step(system, grid, name) for name in raw.names)
        return Phase(tuple(gathering.gathers(raw.connections)), steps, raw.parallel, loop_of(raw.group, raw.inner))

    def loop_of(group: Group | None, inner: Sequence[_RawPhase]) -> Loop | None:
        if not group or not group.iteration:
            return None
        connections = [connection for phase in inner for connection in _read(phase)]
        return Loop(group.name, group.iteration, tuple(map(phase_of, inner)), connections)

    return Plan(system, grid, inputs, signals, list(map(phase_of, phases)))


def _opened(phases: Iterable[Phase]) -> Iterator[Phase]:
    for phase in phases:
        yield phase
        if phase.loop:
            yield from _opened(phase.loop.phases)


def _step(system: System, grid: Grid, name: str) -> Step:
    divisor = int(system.periods.get(name, grid.step) / grid.step)
    return Step(name, system.components[name], divisor, float(grid.step * divisor))


class _RawPhase(NamedTuple):
    """Connections to read, components to step and whether at the same time; then the inner phases of an iterated group."""

    connections: list[Connection]
    names: list[str]
    parallel: Parallel = "auto"
    group: Group | None = None
    inner: Sequence[_RawPhase] = ()


def _read(phase: _RawPhase) -> Iterator[Connection]:
    yield from phase.connections
    for inner in phase.inner:
        yield from _read(inner)


def _phases(system: System) -> Iterator[_RawPhase]:
    """Every phase, in order."""
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
        yield _RawPhase(
            [
                c
                for c in readers
                if c.source.component in inside and c.source.component not in own_group.get(c.target.component, ())
            ],
            [member for member in stage if not isinstance(member, Group)],
            parallel,
        )
        for group in groups:
            inner = _run(group.stages, group.parallel, frozenset(members(group.stages)), incoming)
            if group.iteration:
                yield _RawPhase([], [], group=group, inner=list(inner))
            else:
                yield from inner


def _inputs(system: System, connections: Iterable[Connection]) -> Layout:
    """Inputs in the order in which they are gathered, so that what is gathered together lies together."""
    return _lay_out(system, (connection.target for connection in connections), "input")


def _signals(system: System, connections: Iterable[Connection], recorded: Iterable[Endpoint]) -> Layout:
    """Every output that something reads, in the order in which they are read first."""
    return _lay_out(system, (*(connection.source for connection in connections), *recorded), "output")


def _lay_out(system: System, endpoints: Iterable[Endpoint], causality: Causality) -> Layout:
    wanted: dict[str, dict[str, Variable]] = {name: {} for name in members(system.stages)}
    for endpoint in endpoints:
        variable = system.place(endpoint).variable
        wanted[endpoint.component][variable.name] = variable
    return lay_out({name: _chosen(system.components[name], found, causality) for name, found in wanted.items()})


def _chosen(component: Component, wanted: Mapping[str, Variable], causality: Causality) -> Sequence[Variable]:
    if not component.binds_everything:
        return _by_type(list(wanted.values()))
    return [variable for variable in component.variables if variable.causality == causality or variable.name in wanted]


def _by_type(variables: Sequence[Variable]) -> list[Variable]:
    """Those of one type next to each other, so that one call sets or gets them all; enumerations go with integers."""
    types = [f"Int{8 * v.dtype.itemsize}" if v.type == "Enumeration" else v.type for v in variables]
    return [variable for kind in dict.fromkeys(types) for variable, type_ in zip(variables, types, strict=True) if type_ == kind]
