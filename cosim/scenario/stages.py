"""Stages of a scenario and its nested systems, and the recommendation of a better algorithm."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import permutations
from typing import NamedTuple

from ..core.component import Component, scalars_of
from ..core.errors import abbreviate_names
from ..core.graph import ordered_groups, strong_components
from ..core.system import (
    Connection,
    Endpoint,
    Group,
    Iteration,
    Parallel,
    Stage,
    System,
    component_names,
    iterate_groups,
)
from .nested_systems import Node
from .schema import SystemSpec


class _Link(NamedTuple):
    """Connection without delay between two components.

    `is_direct`: an output of the target depends directly on the input.
    """

    source: str
    target: str
    is_direct: bool


class StagePlanner:
    """Planner of the stages of a scenario.

    A system without stages in its file gets one stage for each component. Its order follows the
    connections without delay: a component steps after those that feed it. In a loop of components
    only inputs count on which an output of their component depends directly. The order of the file
    decides everything else.

    Args:
        components: The components by full name.
        connections: The connections between them.
    """

    def __init__(self, components: Mapping[str, Component], connections: Sequence[Connection]):
        targets = {connection.target.component: None for connection in connections}
        variables = {name: scalars_of(components[name].variables) for name in targets}
        direct = {name: _direct_inputs(components[name]) for name in targets}
        self._links: set[_Link] = set()
        for connection in connections:
            source, target = connection.source.component, connection.target.component
            variable = variables[target].get(connection.target.scalar)
            if variable and not connection.delay:
                inputs = direct[target]
                is_direct = inputs is None or variable.name in inputs
                self._links.add(_Link(source, target, is_direct))

    def root_stages(self, root: Node, spec: SystemSpec) -> tuple[Stage, ...]:
        """Return the root's stages.

        With iteration they form one group, which excludes the input profiles.
        """
        stages, iteration = self._stages(root), _iteration_settings(spec)
        return (
            ((Group(spec.name, stages, parallel_mode(spec), iteration),),) if iteration else stages
        )

    def _stages(self, node: Node) -> tuple[Stage, ...]:
        """Return the stages of a system.

        Unknown, repeated and missing names are reported by `System.problems`.
        """
        if "components" in node.invalid_keys:
            return ()
        algorithm = None if node.has_wrong_names else node.spec.algorithm
        stages = algorithm.stages if algorithm else None
        if stages is None:
            stages = [[name] for name in self._automatic_order(node)]
        result: list[Stage] = []
        for stage in filter(None, stages):
            members: list[str | Group] = []
            for name in stage:
                if name in node.children:
                    spec = node.children[name].spec
                    inner = self._stages(node.children[name]), parallel_mode(spec)
                    group = Group(node.full_name(name), *inner, _iteration_settings(spec))
                    members.append(group)
                elif name not in node.invalid_components:
                    members.append(node.full_name(name))
            result.append(tuple(members))
        return tuple(result)

    def _automatic_order(self, node: Node) -> list[str]:
        depth = len(node.prefix.split(".")) if node.prefix else 0
        prefix = f"{node.prefix}." if node.prefix else ""
        feeders: dict[str, set[str]] = {name: set() for name in node.spec.components}
        direct: dict[str, set[str]] = {name: set() for name in node.spec.components}
        for link in self._links:
            if link.source.startswith(prefix) and link.target.startswith(prefix):
                source, target = (name.split(".")[depth] for name in (link.source, link.target))
                if source != target and {source, target} <= feeders.keys():
                    feeders[target].add(source)
                    if link.is_direct:
                        direct[target].add(source)
        # a group is a loop of components; only direct dependencies order the components in it
        order: list[str] = []
        for group in ordered_groups(feeders):
            for inner in ordered_groups({member: direct[member] for member in group}):
                order += inner
        return order


def _direct_inputs(component: Component) -> frozenset[str] | None:
    """Return the inputs on which an output depends directly; None if they are unknown."""
    outputs = {variable.name for variable in component.variables if variable.causality == "output"}
    if not outputs <= component.dependencies.keys():
        return None
    return frozenset().union(*(component.dependencies[name] for name in outputs))


def parallel_mode(spec: SystemSpec) -> Parallel:
    """Return whether the FMUs of a stage run in parallel threads."""
    return spec.algorithm.parallel if spec.algorithm else "auto"


def _iteration_settings(spec: SystemSpec) -> Iteration | None:
    settings = spec.algorithm.iteration if spec.algorithm else None
    return Iteration(settings.tolerance, settings.limit, settings.method) if settings else None


def recommend(system: System) -> list[str]:
    """Return what would make the results more accurate, one line each with the reason.

    Or one line that the algorithm fits.
    """
    inner = [
        c for c in system.connections if not c.delay and c.source.component != c.target.component
    ]
    feeders: dict[str, set[str]] = {name: set() for name in system.components}
    for connection in inner:
        feeders[connection.target.component].add(connection.source.component)
    groups = ordered_groups(feeders)
    iterated: set[str] = set()
    for each in iterate_groups(system.stages):
        if each.iteration:
            iterated.update(component_names(each.stages))
    lines = list(_late_values(system, inner, groups))
    within = [c for c in system.connections if not c.delay]
    for group in (group for group in groups if not iterated.issuperset(group)):
        lines += _coupling(
            system,
            [c for c in within if {c.source.component, c.target.component} <= set(group)],
            group,
        )
    return lines or [
        (
            "none: components get values of the same step; only values that are fed back are one "
            "step old, or iterated"
        )
    ]


def _late_values(
    system: System, connections: Sequence[Connection], groups: Sequence[Sequence[str]]
) -> Iterator[str]:
    """Yield a line if values are one step old although their reader does not feed their source."""
    number: dict[str, int] = {}
    for i, group in enumerate(groups):
        number |= dict.fromkeys(group, i)
    position = dict(_positions(system.stages))
    late = [
        c
        for c in connections
        if number[c.source.component] != number[c.target.component]
        and not _steps_earlier(position[c.source.component], position[c.target.component])
        and not c.source.component.startswith("inputs.")
    ]
    if late:
        names = abbreviate_names(
            dict.fromkeys(f"{c.source.component} -> {c.target.component}" for c in late)
        )
        yield (
            f'leave out "stages": the values of {names} are one step late, although nothing flows '
            "back"
        )


def _coupling(
    system: System, connections: Sequence[Connection], group: Sequence[str]
) -> Iterator[str]:
    """Yield a line about mutually dependent components whose coupling can be solved better."""
    names = abbreviate_names(group)
    fixed = [
        name for name in group if not system.components[name].has_state or name in system.periods
    ]
    is_direct = bool(_declared_loops(system, connections))
    linear = {c for c in connections if c.interpolation == "linear"}
    can_be_linear = [c for c in connections if _can_be_linear(system, c)]
    position = dict(_positions(system.stages))
    if is_direct and not fixed:
        yield (
            f'"iteration": {{"method": "newton"}} for {names}: their outputs depend directly on '
            "each other, "
            "and all of them can return to a state"
        )
        return
    if is_direct:
        yield (
            f"a smaller step size: outputs of {names} form an algebraic loop, and one of them is "
            "a step late; "
            f"an iteration is not possible, because {abbreviate_names(fixed)} cannot repeat a step"
        )
    if len(group) == 1:
        return
    if can_be_linear and not linear:
        targets = abbreviate_names(dict.fromkeys(c.target.component for c in can_be_linear))
        yield (
            f'"interpolation": "linear" for connections between {names}: {targets} can '
            "interpolate, which raises the order to 2"
        )
    elif not linear and not any(
        _steps_earlier(position[a], position[b]) for a, b in permutations(group, 2)
    ):
        yield (
            f"one stage for each of {names}: they depend on each other, and later stages get "
            "values of the end of the step"
        )


def _can_be_linear(system: System, connection: Connection) -> bool:
    ends = (connection.source, connection.target)
    types = {system.find_element(end).variable.type for end in ends}
    has_period = any(end.component in system.periods for end in ends)
    return (
        system.components[connection.target.component].interpolates_inputs
        and types == {"Float64"}
        and not has_period
    )


def _declared_loops(system: System, connections: Sequence[Connection]) -> list[list[Endpoint]]:
    """Return the loops of direct dependencies that the components declare."""
    successors: dict[Endpoint, list[Endpoint]] = {}
    for connection in connections:
        successors.setdefault(connection.source, []).append(connection.target)
    for end in dict.fromkeys(connection.target for connection in connections):
        dependencies: Mapping[str, frozenset[str]] = system.components[end.component].dependencies
        variable = system.find_element(end).variable.name
        outputs = [source for source in successors if source.component == end.component]
        direct = [
            o
            for o in outputs
            if variable in dependencies.get(system.find_element(o).variable.name, ())
        ]
        successors.setdefault(end, []).extend(direct)
    return [loop for loop in strong_components(successors) if len(loop) > 1]


#: number of the stage, and of the member within it, at each level of nested systems
_Position = tuple[tuple[int, int], ...]


def _positions(stages: Sequence[Stage], prefix: _Position = ()) -> Iterator[tuple[str, _Position]]:
    """Yield (component, position) of all components."""
    for i, stage in enumerate(stages):
        for k, member in enumerate(stage):
            if isinstance(member, Group):
                yield from _positions(member.stages, (*prefix, (i, k)))
            else:
                yield member, (*prefix, (i, k))


def _steps_earlier(one: _Position, other: _Position) -> bool:
    """Return whether the stage of one position steps before that of another one."""
    return next((a[0] < b[0] for a, b in zip(one, other, strict=False) if a != b), False)
