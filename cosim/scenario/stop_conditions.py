"""Conditions of a scenario that end the run."""

from __future__ import annotations

from collections.abc import Mapping

from ..core.component import Component
from ..core.errors import Problem
from ..core.expressions import parse_condition
from ..core.system import Endpoint
from ..engine.settings import StopCondition
from .nested_systems import Node
from .schema import ScenarioSpec, StopSpec
from .schema_types import accepted


class StopConditionReader:
    """Reader of the stop conditions of a scenario.

    Args:
        root: The scenario.
        spec: Its specification.
        components: The components by full name.
        columns: The recorded signals.
        is_complete: Signals are missing only if they are not recorded, and not because of other
            problems.
    """

    def __init__(
        self,
        root: Node,
        spec: ScenarioSpec,
        components: Mapping[str, Component],
        columns: Mapping[str, Endpoint],
        is_complete: bool,
    ):
        self._root, self._components, self._columns, self._is_complete = (
            root,
            components,
            columns,
            is_complete,
        )
        self.problems: list[Problem] = []
        self.conditions: list[StopCondition] = []
        for i, stop in accepted(spec.stop_when):
            if any(condition.name == stop.name for condition in self.conditions):
                self._add_problem(f'the name "{stop.name}" is used more than once', i, "name")
            if text := self._problem(stop):
                self._add_problem(text, i, "when")
            elif is_complete:
                self.conditions.append(
                    StopCondition(stop.name, parse_condition(stop.when), stop.for_, stop.outcome)
                )

    def _problem(self, stop: StopSpec) -> str:
        """Return why a condition cannot be evaluated, or ""."""
        try:
            expression = parse_condition(stop.when)
        except ValueError as error:
            return str(error)
        if text := expression.unknown_name_problem(self._columns, "recorded signal"):
            return text if self._is_complete else ""
        texts = (
            f"{name} is a text, expected a number"
            for name in expression.names
            if self._is_text(self._columns[name])
        )
        return next(texts, "")

    def _is_text(self, endpoint: Endpoint) -> bool:
        variables = self._components[endpoint.component].variables
        return any(
            variable.dtype.hasobject
            for variable in variables
            if endpoint.scalar in variable.scalar_names
        )

    def _add_problem(self, text: str, i: int, key: str) -> None:
        self.problems.append(Problem(text, self._root.where("stop_when", i, key)))
