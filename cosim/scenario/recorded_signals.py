"""Recorded signals, which patterns select, and the stop conditions on them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from ..core.component import Component, scalars_of
from ..core.errors import Problem, pattern_hint
from ..core.expressions import parse_condition
from ..core.system import Endpoint
from ..engine.settings import StopCondition
from .name_resolution import PrefixIndex
from .nested_systems import Node
from .schema import ScenarioSpec, StopSpec
from .schema_types import accepted


class SignalSelector:
    """Selector of signals by patterns in which "*" matches any characters, including dots.

    A pattern selects outputs. A pattern that matches no output may select local variables and
    parameters.

    Args:
        components: The components by full name.
        aliases: Outputs of nested systems by the names of their ports.
        invalid: Names of invalid components; a pattern that may refer to one of them is not
            reported as a problem.
    """

    def __init__(
        self,
        components: Mapping[str, Component],
        aliases: Mapping[str, Endpoint],
        invalid: Sequence[str],
    ):
        self._outputs = {**_signal_endpoints(components, ("output",)), **aliases}
        self._others = _signal_endpoints(
            components,
            (
                "input",
                "local",
                "parameter",
                "calculatedParameter",
                "structuralParameter",
                "independent",
            ),
        )
        self._output_index, self._other_index = (
            PrefixIndex(self._outputs),
            PrefixIndex(self._others),
        )
        self._invalid = invalid
        self.problems: list[Problem] = []

    def select(self, patterns: Iterable[tuple[str, str]]) -> dict[str, Endpoint]:
        """Return the signals that match patterns, in the order of components and variables.

        The patterns are pairs of (pattern, location in the file).
        """
        selected: set[str] = set()
        for pattern, where in patterns:
            matches = _matching_names(pattern, self._output_index) or _matching_names(
                pattern, self._other_index
            )
            if not matches and not self._may_match_invalid(pattern):
                names = {**self._outputs, **self._others}
                self.problems.append(
                    Problem(f'no variable matches "{pattern}"{pattern_hint(pattern, names)}', where)
                )
            selected.update(matches)
        return {
            name: end for name, end in {**self._outputs, **self._others}.items() if name in selected
        }

    def _may_match_invalid(self, pattern: str) -> bool:
        prefix = pattern.partition("*")[0]
        return any(prefix.startswith(name) or name.startswith(prefix) for name in self._invalid)


def _signal_endpoints(
    components: Mapping[str, Component], causalities: Sequence[str]
) -> dict[str, Endpoint]:
    ends = {}
    for name, component in components.items():
        for scalar in scalars_of(component.variables, *causalities):
            ends[f"{name}.{scalar}"] = Endpoint(name, scalar)
    return ends


def _matching_names(pattern: str, names: PrefixIndex) -> list[str]:
    if "*" not in pattern:
        return [name for name in names.with_prefix(pattern)[:1] if name == pattern]
    if pattern.find("*") == len(pattern) - 1:
        return list(names.with_prefix(pattern[:-1]))
    first, *middle, last = map(re.escape, pattern.split("*"))
    # atomic groups prevent backtracking: the time is at most proportional to the lengths of pattern
    # and name multiplied
    parts = "".join(f"(?>.*?{part})" for part in middle if part)
    matches = re.compile(f"{first}{parts}.*{last}").fullmatch
    return [name for name in names.with_prefix(pattern.partition("*")[0]) if matches(name)]


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
