"""Locations in the scenario file of the problems of a system and its settings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from ..core.errors import Problem
from .nested_systems import Node

#: settings whose times must fit the communication points
_TIMED_SETTINGS = (("stop_time",), ("record",), ("events",))


def located_problems(root: Node, problems: Iterable[Problem]) -> Iterator[Problem]:
    """Yield the problems of a system with the locations of their subjects, without those that follow from invalid times.

    Args:
        root: The scenario.
        problems: Problems that `check_run` found.
    """
    return (
        _with_location(root, problem) for problem in problems if not _is_consequence(root, problem)
    )


def _is_consequence(root: Node, problem: Problem) -> bool:
    """Return True if a problem with times only follows from an invalid start time, stop time or step size."""
    times = {"stop_time", "step_size", "start_time"} & root.invalid_keys
    return bool(times) and (
        problem.subject[:1] in _TIMED_SETTINGS
        or problem.subject[-1:] in (("period",), ("step_size",))
    )


def _with_location(root: Node, problem: Problem) -> Problem:
    if problem.where or not problem.subject:
        return problem
    key, *rest = problem.subject
    if key == "components" and rest and (found := root.find_component(rest[0])):
        node, name = found
        return replace(problem, where=node.where("components", name, *rest[1:]), subject=())
    return replace(problem, where=root.where(*problem.subject), subject=())
