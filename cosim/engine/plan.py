"""Compilation of a system into a flat plan: phases of transfers and steps on shared arrays.

A stage becomes a phase: all its inputs are set first, then its components step. The order within a
stage therefore has no influence (Jacobi); one component per stage is Gauss-Seidel. A group (nested
system) gets its outer inputs with its stage and then runs its own phases.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import NamedTuple

from ..core.component import Causality, Component, PreparedCall, Variable
from ..core.errors import abbreviate_names
from ..core.system import (
    Connection,
    Endpoint,
    Group,
    Iteration,
    Parallel,
    Stage,
    System,
    component_names,
)
from ..core.time_grid import TimeGrid
from .layout import Layout, build_layout
from .run_checks import check_run, components_with_fixed_steps
from .settings import Event, Settings
from .transfer_plan import Transfer, TransferPlanner, slope_variable, term_endpoint


@dataclass(frozen=True, eq=False)
class Step:
    """A component's step: in every `divisor`-th macro step it advances by `step_size` (s)."""

    name: str
    component: Component
    divisor: int
    step_size: float


@dataclass(frozen=True, eq=False)
class Phase:
    """Transfers, then steps, then a loop."""

    transfers: tuple[Transfer, ...]
    steps: tuple[Step, ...]
    parallel: Parallel = "auto"
    loop: Loop | None = None


class ScheduledStep(NamedTuple):
    """A component's step as calls that return an FMI status.

    `first_call` is the number of the first call.
    """

    step: Step
    calls: Sequence[PreparedCall]
    first_call: int


@dataclass(frozen=True, eq=False)
class Loop:
    """Phases iterated within a macro step until their connected outputs converge."""

    name: str
    iteration: Iteration
    phases: tuple[Phase, ...]
    connections: Sequence[Connection]

    @property
    def components(self) -> dict[str, Component]:
        """Components of the loop, by name."""
        return {step.name: step.component for step in all_steps(self.all_phases)}

    @property
    def all_phases(self) -> Iterator[Phase]:
        """All phases of the loop, each followed by the phases of its inner loop."""
        return _flatten_phases(self.phases)


@dataclass(frozen=True, eq=False)
class Plan:
    """A system and its settings, checked and compiled; it can be simulated once.

    Attributes:
        system: the components and their connections.
        settings: when and how to simulate.
        grid: the communication points.
        record_every: recording interval (macro steps).
        events: events by communication point.
        inputs: layout of the connected inputs.
        outputs: layout of the connected and recorded outputs.
        phases: the phases of a macro step, in order.
    """

    system: System
    settings: Settings
    grid: TimeGrid
    record_every: int
    events: Mapping[int, Sequence[Event]]
    inputs: Layout
    outputs: Layout
    phases: Sequence[Phase]

    @property
    def row_count(self) -> int:
        """Number of recorded communication points."""
        return self.grid.count // self.record_every + 1

    @property
    def end_warning(self) -> str:
        """Message that the run ends before the stop time; "" if it does not.

        Some components cannot make a shorter last step.
        """
        end, stop = self.grid.end, self.settings.stop_time
        if end == stop:
            return ""
        periods = " and all periods" if self.system.periods else ""
        reason = f"the last whole multiple of the step size {float(self.grid.step):.12g} s{periods}"
        names = abbreviate_names(components_with_fixed_steps(self.system, self.settings))
        return (
            f"the run ends at t = {float(end):.12g} s, {reason} before the stop time "
            f"{float(stop):.12g} s, "
            f"because {names} cannot make a shorter step"
        )

    @cached_property
    def shorter_steps(self) -> Mapping[int, Mapping[str, float]]:
        """Sizes (s) of shorter last steps, by macro step in which they begin and by component."""
        found: dict[int, dict[str, float]] = defaultdict(dict)
        for step in all_steps(self.all_phases) if self.grid.count else ():
            begin = (self.grid.count - 1) // step.divisor * step.divisor
            rest = self.grid.end - self.grid.start - begin * self.grid.step
            if rest < step.divisor * self.grid.step:
                found[begin][step.name] = float(rest)
        return found

    @property
    def all_phases(self) -> Iterator[Phase]:
        """All phases, each followed by the phases of its loop."""
        return _flatten_phases(self.phases)


def compile_plan(system: System, settings: Settings) -> Plan:
    """Check a system and compile it into a plan.

    Args:
        system: the components must not have been used before.
        settings: when and how to simulate.

    Raises:
        InputError: the system cannot be simulated with these settings; `problems` lists all
            reasons, see `check_run`.
    """
    grid = check_run(system, settings)
    incoming: dict[str, list[Connection]] = defaultdict(list)
    for connection in system.connections:
        incoming[connection.target.component].append(connection)
    inside = frozenset(system.components)
    phases = list(_phases_of_stages(system.stages, system.parallel, inside, incoming))
    connections = list(chain.from_iterable(map(_connections_of, phases)))
    # inputs in the order of transfers, so that the targets of each are consecutive; outputs in the
    # order of their first use
    targets = [connection.target for connection in connections]
    terms = [Variable(term_endpoint(c).scalar) for c in connections if c.term]
    linear = [c.target for c in connections if c.interpolation == "linear"]
    inputs = _layout_of_endpoints(system, targets, "input", terms, linear)
    sources = [*(connection.source for connection in connections), *settings.columns.values()]
    sloped = _extrapolated_sources(system, phases, set())
    outputs = _layout_of_endpoints(system, sources, "output", (), sloped)
    planner = TransferPlanner(system, inputs, outputs, float(grid.step))
    stepped: set[str] = set()

    def make_phase(draft: _PhaseDraft) -> Phase:
        steps = []
        for name in draft.names:
            divisor = int(system.periods.get(name, grid.step) / grid.step)
            step_size = float(grid.step * divisor)
            steps.append(Step(name, system.components[name], divisor, step_size))
        transfers = tuple(planner.plan_transfers(draft.connections, stepped))
        stepped.update(draft.names)
        return Phase(transfers, tuple(steps), draft.parallel, make_loop(draft.group, draft.inner))

    def make_loop(group: Group | None, inner: Sequence[_PhaseDraft]) -> Loop | None:
        if not group or not group.iteration:
            return None
        connections = list(chain.from_iterable(map(_connections_of, inner)))
        stepped.update(component_names(group.stages))  # a repeated step knows the values at its end
        return Loop(group.name, group.iteration, tuple(map(make_phase, inner)), connections)

    record_every = int((settings.record_interval or grid.step) / grid.step)
    events: dict[int, list[Event]] = defaultdict(list)
    for event in settings.events:
        events[grid.index(event.time)].append(event)
    return Plan(
        system, settings, grid, record_every, events, inputs, outputs, list(map(make_phase, phases))
    )


def all_steps(phases: Iterable[Phase]) -> Iterator[Step]:
    """Yield the steps of phases, in order."""
    return chain.from_iterable(phase.steps for phase in phases)


def all_transfers(phases: Iterable[Phase]) -> Iterator[Transfer]:
    """Yield the transfers of phases, in order."""
    return chain.from_iterable(phase.transfers for phase in phases)


def _flatten_phases(phases: Iterable[Phase]) -> Iterator[Phase]:
    for phase in phases:
        yield phase
        if phase.loop:
            yield from _flatten_phases(phase.loop.phases)


class _PhaseDraft(NamedTuple):
    """A phase before its transfers are planned.

    Connections, names of components, and the inner phases of an iterated group.
    """

    connections: list[Connection]
    names: list[str]
    parallel: Parallel = "auto"
    group: Group | None = None
    inner: Sequence[_PhaseDraft] = ()


def _connections_of(phase: _PhaseDraft) -> Iterator[Connection]:
    yield from phase.connections
    for inner in phase.inner:
        yield from _connections_of(inner)


def _phases_of_stages(
    stages: Sequence[Stage],
    parallel: Parallel,
    inside: frozenset[str],
    incoming: Mapping[str, Sequence[Connection]],
) -> Iterator[_PhaseDraft]:
    """Yield the phases of the stages.

    Connections from components outside `inside` are not read here: an enclosing stage has read
    them.
    """
    for stage in stages:
        groups = [member for member in stage if isinstance(member, Group)]
        members = [frozenset(component_names(group.stages)) for group in groups]
        own_group: dict[str, frozenset[str]] = {}
        for names in members:
            own_group |= dict.fromkeys(names, names)
        connections: list[Connection] = []
        for name in component_names([stage]):
            connections += incoming.get(name, ())
        yield _PhaseDraft(
            [
                c
                for c in connections
                if c.source.component in inside
                and c.source.component not in own_group.get(c.target.component, ())
            ],
            [member for member in stage if not isinstance(member, Group)],
            parallel,
        )
        for group, names in zip(groups, members, strict=True):
            inner = _phases_of_stages(group.stages, group.parallel, names, incoming)
            if group.iteration:
                yield _PhaseDraft([], [], group=group, inner=list(inner))
            else:
                yield from inner


def _extrapolated_sources(
    system: System, phases: Iterable[_PhaseDraft], stepped: set[str]
) -> Iterator[Endpoint]:
    """Yield outputs with given slopes that linear connections use before their component steps."""
    for phase in phases:
        for source in (c.source for c in phase.connections if c.interpolation == "linear"):
            if (
                source.component not in stepped
                and system.components[source.component].gives_output_slopes
            ):
                yield source
        stepped.update(phase.names, component_names(phase.group.stages) if phase.group else ())
        yield from _extrapolated_sources(system, phase.inner, stepped)


def _layout_of_endpoints(
    system: System,
    endpoints: Iterable[Endpoint],
    causality: Causality,
    terms: Sequence[Variable],
    sloped: Iterable[Endpoint],
) -> Layout:
    used: dict[str, dict[str, Variable]] = {name: {} for name in component_names(system.stages)}
    for endpoint in endpoints:
        variable = system.find_element(endpoint).variable
        used[endpoint.component][variable.name] = variable
    bound = {
        name: _variables_to_bind(system.components[name], some, causality)
        for name, some in used.items()
    }
    slopes: dict[str, dict[str, Variable]] = defaultdict(dict)
    for endpoint in sloped:
        variable = system.find_element(endpoint).variable
        slopes[endpoint.component][variable.name] = slope_variable(variable)
    bound |= {name: [*bound[name], *own.values()] for name, own in slopes.items()}
    return build_layout({**bound, "": terms} if terms else bound)


def _variables_to_bind(
    component: Component, used: Mapping[str, Variable], causality: Causality
) -> Sequence[Variable]:
    """Return the variables that are used, or all of the causality and the others that are used.

    Used variables are grouped by type, so that one FMI call sets or gets all of a type.
    Enumerations count as integers.
    """
    if component.binds_everything:
        own = [variable for variable in component.variables if variable.causality == causality]
        return [*own, *(variable for variable in used.values() if variable.causality != causality)]
    groups: dict[str, list[Variable]] = defaultdict(list)
    for variable in used.values():
        is_enumeration = variable.type == "Enumeration"
        kind = f"Int{8 * variable.dtype.itemsize}" if is_enumeration else variable.type
        groups[kind].append(variable)
    return list(chain.from_iterable(groups.values()))
