"""Stages of a scenario and its nested systems."""

from __future__ import annotations

from ..core.system import Group, Iteration, Parallel, Stage
from .nested_systems import Node
from .schema import SystemSpec


def root_stages(root: Node, spec: SystemSpec) -> tuple[Stage, ...]:
    """Return the root's stages; with iteration they form one group, which excludes the input profiles."""
    stages, iteration = _stages(root), _iteration_settings(spec)
    return ((Group(spec.name, stages, parallel_mode(spec), iteration),),) if iteration else stages


def _stages(node: Node) -> tuple[Stage, ...]:
    """Return the stages of a system. Unknown, repeated and missing names are reported by `System.problems`."""
    if "components" in node.invalid_keys:
        return ()
    listed = node.spec.algorithm.stages if node.spec.algorithm and not node.has_wrong_names else None
    stages = [[name] for name in node.spec.components] if listed is None else listed
    return tuple(
        tuple(_stage_member(node, name) for name in stage if name not in node.invalid_components) for stage in stages if stage
    )


def _stage_member(node: Node, name: str) -> str | Group:
    if name in node.children:
        child = node.children[name]
        return Group(node.full_name(name), _stages(child), parallel_mode(child.spec), _iteration_settings(child.spec))
    return node.full_name(name)


def parallel_mode(spec: SystemSpec) -> Parallel:
    """Return whether the FMUs of a stage run in parallel threads."""
    return spec.algorithm.parallel if spec.algorithm else "auto"


def _iteration_settings(spec: SystemSpec) -> Iteration | None:
    settings = spec.algorithm.iteration if spec.algorithm else None
    return Iteration(settings.tolerance, settings.limit) if settings else None
