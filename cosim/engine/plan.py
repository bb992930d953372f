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
from ..core.system import Connection, Endpoint, Group, Iteration, Parallel, Stage, System, component_names
from ..core.time_grid import TimeGrid
from .layout import Layout, build_layout
from .transfer_plan import Transfer, TransferPlanner


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

    transfers: tuple[Transfer, ...]
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
        return {step.name: step.component for phase in _flatten_phases(self.phases) for step in phase.steps}


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything an executor needs."""

    system: System
    grid: TimeGrid
    inputs: Layout
    outputs: Layout
    phases: Sequence[Phase]

    @property
    def all_phases(self) -> Iterator[Phase]:
        """The phases, each followed by those of its loop."""
        return _flatten_phases(self.phases)


def compile_plan(system: System, grid: TimeGrid, recorded_outputs: Iterable[Endpoint] = ()) -> Plan:
    """Lay out the arrays and order the work. The system must have no problems, its periods must fit the grid."""
    phases = list(_split_into_phases(system))
    connections = [connection for phase in phases for connection in _connections_of(phase)]
    inputs, signals = _input_layout(system, connections), _output_layout(system, connections, recorded_outputs)
    gathering = TransferPlanner(system, inputs, signals)

    def phase_of(raw: _PhaseDraft) -> Phase:
        steps = tuple(_make_step(system, grid, name) for name in raw.names)
        return Phase(tuple(gathering.plan_transfers(raw.connections)), steps, raw.parallel, loop_of(raw.group, raw.inner))

    def loop_of(group: Group | None, inner: Sequence[_PhaseDraft]) -> Loop | None:
        if not group or not group.iteration:
            return None
        connections = [connection for phase in inner for connection in _connections_of(phase)]
        return Loop(group.name, group.iteration, tuple(map(phase_of, inner)), connections)

    return Plan(system, grid, inputs, signals, list(map(phase_of, phases)))


def _flatten_phases(phases: Iterable[Phase]) -> Iterator[Phase]:
    for phase in phases:
        yield phase
        if phase.loop:
            yield from _flatten_phases(phase.loop.phases)


def _make_step(system: System, grid: TimeGrid, name: str) -> Step:
    divisor = int(system.periods.get(name, grid.step) / grid.step)
    return Step(name, system.components[name], divisor, float(grid.step * divisor))


class _PhaseDraft(NamedTuple):
    """Connections to read, components to step and whether at the same time; then the inner phases of an iterated group."""

    connections: list[Connection]
    names: list[str]
    parallel: Parallel = "auto"
    group: Group | None = None
    inner: Sequence[_PhaseDraft] = ()


def _connections_of(phase: _PhaseDraft) -> Iterator[Connection]:
    yield from phase.connections
    for inner in phase.inner:
        yield from _connections_of(inner)


def _split_into_phases(system: System) -> Iterator[_PhaseDraft]:
    """Every phase, in order."""
    incoming: dict[str, list[Connection]] = defaultdict(list)
    for connection in system.connections:
        incoming[connection.target.component].append(connection)
    yield from _phases_of_stages(system.stages, system.parallel, frozenset(system.components), incoming)


def _phases_of_stages(
    stages: Sequence[Stage], parallel: Parallel, inside: frozenset[str], incoming: Mapping[str, Sequence[Connection]]
) -> Iterator[_PhaseDraft]:
    """Phases of stages whose members read from `inside` now; everything else was read before."""
    for stage in stages:
        groups = [member for member in stage if isinstance(member, Group)]
        own_group = {name: frozenset(component_names(group.stages)) for group in groups for name in component_names(group.stages)}
        readers = [connection for name in component_names([stage]) for connection in incoming.get(name, ())]
        yield _PhaseDraft(
            [
                c
                for c in readers
                if c.source.component in inside and c.source.component not in own_group.get(c.target.component, ())
            ],
            [member for member in stage if not isinstance(member, Group)],
            parallel,
        )
        for group in groups:
            inner = _phases_of_stages(group.stages, group.parallel, frozenset(component_names(group.stages)), incoming)
            if group.iteration:
                yield _PhaseDraft([], [], group=group, inner=list(inner))
            else:
                yield from inner


def _input_layout(system: System, connections: Iterable[Connection]) -> Layout:
    """Inputs in the order in which they are gathered, so that what is gathered together lies together."""
    return _layout_of_endpoints(system, (connection.target for connection in connections), "input")


def _output_layout(system: System, connections: Iterable[Connection], recorded: Iterable[Endpoint]) -> Layout:
    """Every output that something reads, in the order in which they are read first."""
    return _layout_of_endpoints(system, (*(connection.source for connection in connections), *recorded), "output")


def _layout_of_endpoints(system: System, endpoints: Iterable[Endpoint], causality: Causality) -> Layout:
    wanted: dict[str, dict[str, Variable]] = {name: {} for name in component_names(system.stages)}
    for endpoint in endpoints:
        variable = system.find_element(endpoint).variable
        wanted[endpoint.component][variable.name] = variable
    return build_layout({name: _variables_to_bind(system.components[name], found, causality) for name, found in wanted.items()})


def _variables_to_bind(component: Component, wanted: Mapping[str, Variable], causality: Causality) -> Sequence[Variable]:
    if not component.binds_everything:
        return _group_by_type(list(wanted.values()))
    return [variable for variable in component.variables if variable.causality == causality or variable.name in wanted]


def _group_by_type(variables: Sequence[Variable]) -> list[Variable]:
    """Those of one type next to each other, so that one call sets or gets them all; enumerations go with integers."""
    types = [f"Int{8 * v.dtype.itemsize}" if v.type == "Enumeration" else v.type for v in variables]
    return [variable for kind in dict.fromkeys(types) for variable, type_ in zip(variables, types, strict=True) if type_ == kind]
