"""A system compiled once into flat arrays: who steps when, and which value goes where before that.

All outputs of one dtype lie in one array (the signals), each component's in one piece; likewise all inputs. A `Gather`
moves connected values from signals into inputs. Stages become phases: first the whole stage reads what comes from outside,
then its components step; since everything was read before, the order inside a stage has no influence (Jacobi), and one
component per stage is Gauss-Seidel. A group (nested system) reads its outside values with its stage and then runs phases of
its own.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..component import Component, Ports, Variable
from ..system import Connection, Endpoint, Group, Stage, System, members
from ..timing import Grid

Dtype = np.dtype[Any]
Store = dict[Dtype, np.ndarray]


class Slot(NamedTuple):
    """Where a value lies: in the array of its dtype, at this place."""

    dtype: Dtype
    offset: int


@dataclass(frozen=True, eq=False)
class Gather:
    """Values of one dtype that move together: target = factor * source + offset, `delay` macro steps late."""

    component: str
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


@dataclass(frozen=True, eq=False)
class Plan:
    """Everything an executor needs; `places` tells where each bound output lies."""

    system: System
    grid: Grid
    signals: Store
    inputs: Store
    ports: Mapping[str, tuple[Ports, Ports]]
    places: Mapping[Endpoint, Slot]
    phases: Sequence[Phase]

    @property
    def steps(self) -> Iterator[Step]:
        """All steps in the order of a macro step."""
        return (step for phase in self.phases for step in phase.steps)


@dataclass
class _Draft:
    """A gather while its connections are collected."""

    component: str
    connections: list[Connection] = field(default_factory=list)


def compile_plan(system: System, grid: Grid, recorded: Iterable[Endpoint] = ()) -> Plan:
    """Lay out the arrays and order the work. The system must have no problems, its periods must fit the grid."""
    divisors = {name: int(system.periods.get(name, grid.step) / grid.step) for name in system.components}
    drafts = [(list(gathers), names) for gathers, names in _phases(system)]
    inputs, input_ports, input_places = _inputs(system, drafts)
    signals, output_ports, places = _outputs(system, recorded)
    phases = tuple(
        Phase(
            tuple(_gather(system, draft, signals, places, inputs, input_places) for draft in gathers),
            tuple(Step(name, system.components[name], divisors[name], float(grid.step * divisors[name])) for name in names),
        )
        for gathers, names in drafts
    )
    ports = {name: (input_ports[name], output_ports[name]) for name in members(system.stages)}
    return Plan(system, grid, signals, inputs, ports, places, phases)


def _phases(system: System) -> Iterator[tuple[Iterable[_Draft], list[str]]]:
    """(gathers, component names) of every phase, in order."""
    incoming: dict[str, list[Connection]] = defaultdict(list)
    for connection in system.connections:
        incoming[connection.target.component].append(connection)
    yield from _run(system.stages, frozenset(system.components), incoming, system)


def _run(
    stages: Sequence[Stage], inside: frozenset[str], incoming: dict[str, list[Connection]], system: System
) -> Iterator[tuple[Iterable[_Draft], list[str]]]:
    """Phases of stages whose members read from `inside` now; everything else was read before."""
    for stage in stages:
        readers = [c for name in members([stage]) for c in incoming[name] if c.source.component in inside]
        groups = [member for member in stage if isinstance(member, Group)]
        names = [member for member in stage if not isinstance(member, Group)]
        internal = {name: frozenset(members(group.stages)) for group in groups for name in members(group.stages)}
        now = [c for c in readers if c.source.component not in internal.get(c.target.component, ())]
        yield _drafts(system, now), names
        for group in groups:
            yield from _run(group.stages, frozenset(members(group.stages)), incoming, system)


def _drafts(system: System, connections: Iterable[Connection]) -> Iterable[_Draft]:
    """Connections sorted into gathers: one for each component, pair of dtypes, delay, and with or without conversion."""
    drafts: dict[tuple[Any, ...], _Draft] = {}
    for connection in connections:
        source, target = system.place(connection.source).variable, system.place(connection.target).variable
        converted = conversion(source, target) != (1.0, 0.0)
        key = (connection.target.component, source.dtype, target.dtype, connection.delay, converted)
        drafts.setdefault(key, _Draft(connection.target.component)).connections.append(connection)
    return drafts.values()


def conversion(source: Variable, target: Variable) -> tuple[float, float]:
    """(factor, offset) from the source's unit to the target's; (1.0, 0.0) where one of them has no unit."""
    if source.unit is None or target.unit is None:
        return 1.0, 0.0
    return source.unit.conversion(target.unit)


def _inputs(
    system: System, drafts: Iterable[tuple[list[_Draft], list[str]]]
) -> tuple[Store, dict[str, Ports], dict[Endpoint, Slot]]:
    """Input arrays, ordered within each component so that what is gathered together lies together."""
    wanted: dict[str, dict[str, Variable]] = {name: {} for name in members(system.stages)}
    for gathers, _ in drafts:
        for draft in gathers:
            for connection in draft.connections:
                variable = system.place(connection.target).variable
                wanted[draft.component].setdefault(variable.name, variable)
    for name in wanted:
        if system.components[name].binds_everything:
            wanted[name] = {v.name: v for v in system.components[name].variables if v.causality == "input"}
    return _layout({name: list(variables.values()) for name, variables in wanted.items()})


def _outputs(system: System, recorded: Iterable[Endpoint]) -> tuple[Store, dict[str, Ports], dict[Endpoint, Slot]]:
    """Signal arrays with every output that something reads."""
    read = {name: set() for name in members(system.stages)}  # type: dict[str, set[str]]
    for endpoint in (*(c.source for c in system.connections), *recorded):
        read[endpoint.component].add(system.place(endpoint).variable.name)
    return _layout(
        {
            name: [
                variable
                for variable in system.components[name].variables
                if variable.name in names or (system.components[name].binds_everything and variable.causality == "output")
            ]
            for name, names in read.items()
        }
    )


def _layout(variables: Mapping[str, Sequence[Variable]]) -> tuple[Store, dict[str, Ports], dict[Endpoint, Slot]]:
    """One array per dtype for all components; each component gets its slices, each slot its place."""
    places: dict[Endpoint, Slot] = {}
    extents: dict[Dtype, int] = defaultdict(int)
    slices: dict[str, dict[Dtype, slice]] = defaultdict(dict)
    for name, owned in variables.items():
        for dtype in {variable.dtype: None for variable in owned}:
            first = extents[dtype]
            for variable in owned:
                for slot in variable.slots if variable.dtype == dtype else ():
                    places[Endpoint(name, slot)] = Slot(dtype, extents[dtype])
                    extents[dtype] += 1
            slices[name][dtype] = slice(first, extents[dtype])
    store = {dtype: _blank(dtype, extent) for dtype, extent in extents.items()}
    ports = {
        name: Ports(tuple(owned), {dtype: store[dtype][part] for dtype, part in slices[name].items()})
        for name, owned in variables.items()
    }
    return store, ports, places


def _blank(dtype: Dtype, size: int) -> np.ndarray:
    return np.full(size, "", dtype) if dtype.hasobject else np.zeros(size, dtype)


def _gather(
    system: System,
    draft: _Draft,
    signals: Store,
    places: Mapping[Endpoint, Slot],
    inputs: Store,
    input_places: Mapping[Endpoint, Slot],
) -> Gather:
    connections = draft.connections
    sources = [places[c.source] for c in connections]
    targets = [input_places[c.target] for c in connections]
    conversions = [conversion(system.place(c.source).variable, system.place(c.target).variable) for c in connections]
    converted = any(pair != (1.0, 0.0) for pair in conversions)
    return Gather(
        draft.component,
        signals[sources[0].dtype],
        np.array([slot.offset for slot in sources], np.intp),
        inputs[targets[0].dtype],
        np.array([slot.offset for slot in targets], np.intp),
        connections[0].delay,
        np.array([factor for factor, _ in conversions]) if converted else None,
        np.array([offset for _, offset in conversions]) if converted else None,
    )
