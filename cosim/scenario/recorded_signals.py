"""Recorded signals, which patterns select, and the stop conditions on them."""

import re
from collections.abc import Iterable, Mapping, Sequence

from ..core.component import Component, scalars_of
from ..core.errors import Problem, pattern_hint
from ..core.expressions import parse_condition
from ..core.system import Endpoint
from ..engine.settings import StopCondition
from .name_resolution import PrefixIndex
from .nested_systems import Node
from .schema import ScenarioSpec
from .schema_types import accepted

_OTHER_CAUSALITIES = (
    "input",
    "local",
    "parameter",
    "calculatedParameter",
    "structuralParameter",
    "independent",
)


def select_signals(
    components: Mapping[str, Component],
    aliases: Mapping[str, Endpoint],
    patterns: Iterable[tuple[str, str]],
    invalid: Sequence[str],
) -> tuple[dict[str, Endpoint], list[Problem]]:
    """Return the signals that match patterns, in the order of components and variables.

    In a pattern "*" matches any characters, including dots. A pattern selects outputs. One that
    matches no output may select local variables and parameters.

    Args:
        components: The components by full name.
        aliases: Outputs of nested systems by the names of their ports.
        patterns: Pairs of (pattern, location in the file).
        invalid: Names of invalid components; a pattern that may refer to one of them is no problem.

    Returns:
        The signals, and a problem for each pattern that matches none.
    """
    outputs = {**_signal_endpoints(components, "output"), **aliases}
    others = _signal_endpoints(components, *_OTHER_CAUSALITIES)
    signals = {**outputs, **others}
    indices = PrefixIndex(outputs), PrefixIndex(others)
    selected: set[str] = set()
    problems = []
    for pattern, where in patterns:
        prefix = pattern.partition("*")[0]
        matches = _matching_names(pattern, indices[0]) or _matching_names(pattern, indices[1])
        if not matches and not any(
            prefix.startswith(name) or name.startswith(prefix) for name in invalid
        ):
            text = f'no variable matches "{pattern}"{pattern_hint(pattern, signals)}'
            problems.append(Problem(text, where))
        selected.update(matches)
    return {name: end for name, end in signals.items() if name in selected}, problems


def _signal_endpoints(
    components: Mapping[str, Component], *causalities: str
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


def read_stop_conditions(
    root: Node,
    spec: ScenarioSpec,
    components: Mapping[str, Component],
    columns: Mapping[str, Endpoint],
    is_complete: bool,
) -> tuple[list[StopCondition], list[Problem]]:
    """Return the stop conditions of a scenario, and their problems.

    Args:
        root: The scenario.
        spec: Its specification.
        components: The components by full name.
        columns: The recorded signals.
        is_complete: Signals are missing only if they are not recorded, and not because of other
            problems.
    """
    conditions: list[StopCondition] = []
    problems: list[Problem] = []
    for i, stop in accepted(spec.stop_when):
        if any(condition.name == stop.name for condition in conditions):
            text = f'the name "{stop.name}" is used more than once'
            problems.append(Problem(text, root.where("stop_when", i, "name")))
        try:
            expression = parse_condition(stop.when)
            text = expression.unknown_name_problem(columns, "recorded signal")
            if text and not is_complete:
                continue
            for name in () if text else expression.names:
                component, scalar = columns[name]
                if scalars_of(components[component].variables)[scalar].dtype.hasobject:
                    text = f"{name} is a text, expected a number"
                    break
        except ValueError as error:
            text = str(error)
        if text:
            problems.append(Problem(text, root.where("stop_when", i, "when")))
        elif is_complete:
            conditions.append(StopCondition(stop.name, expression, stop.for_, stop.outcome))
    return conditions, problems
