"""Stages of a scenario and its nested systems."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ..core.component import Component
from ..core.graph import ordered_groups
from ..core.system import Connection, Group, Iteration, Parallel, Stage
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
        variables: dict[str, dict[str, str]] = {}
        for end in {connection.target: None for connection in connections}:
            if end.component not in variables:
                own = components[end.component].variables
                variables[end.component] = {
                    scalar: variable.name for variable in own for scalar in variable.scalar_names
                }
        direct = {name: _direct_inputs(components[name]) for name in variables}
        self._links = {
            _Link(
                c.source.component,
                c.target.component,
                inputs is None or variables[c.target.component][c.target.scalar] in inputs,
            )
            for c in connections
            if not c.delay and c.target.scalar in variables[c.target.component]
            for inputs in (direct[c.target.component],)
        }

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
        listed = (
            node.spec.algorithm.stages if node.spec.algorithm and not node.has_wrong_names else None
        )
        stages = [[name] for name in self._automatic_order(node)] if listed is None else listed
        return tuple(
            tuple(
                self._stage_member(node, name)
                for name in stage
                if name not in node.invalid_components
            )
            for stage in stages
            if stage
        )

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
        return [
            name
            for group in ordered_groups(feeders)
            for inner in ordered_groups({member: direct[member] for member in group})
            for name in inner
        ]

    def _stage_member(self, node: Node, name: str) -> str | Group:
        if name in node.children:
            child = node.children[name]
            return Group(
                node.full_name(name),
                self._stages(child),
                parallel_mode(child.spec),
                _iteration_settings(child.spec),
            )
        return node.full_name(name)


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
