"""Construction of a system and its settings from a scenario, collecting all problems."""

import logging
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from typing import Any

from ..core import component_log
from ..core.component import Component, Variable, count_scalars, scalars_of
from ..core.errors import InputError, Problem, merge_problems, pattern_hint
from ..core.expressions import parse_condition
from ..core.size_limits import MAX_SCALARS, require_at_most
from ..core.system import Connection, Endpoint, System
from ..engine.pacer import LatePolicy
from ..engine.plan import Plan, compile_plan
from ..engine.settings import Event, Settings, StopCondition
from .component_sources import ComponentFactory, Creation
from .function_arguments import FunctionResolver, without_placeholders
from .name_resolution import (
    PrefixIndex,
    SlotIndex,
    UnknownNameError,
    check_assignment,
    iterate_assignments,
    resolve_name,
    values_by_component,
)
from .named_functions import find_function_problems
from .nested_systems import Node, Scenario
from .schema import ScenarioSpec
from .schema_types import accepted
from .stages import StagePlanner, parallel_mode
from .wiring import Wiring

#: causalities of the signals that a pattern selects if it matches no output
_OTHER_CAUSALITIES = (
    "input",
    "local",
    "parameter",
    "calculatedParameter",
    "structuralParameter",
    "independent",
)

#: prefix of the components made from input profiles: inputs.0, inputs.1, ...
PROFILE_PREFIX = "inputs"


class SystemBuilder:
    """Builder of a system: call `make_components`, then `build_plan`; each adds to `problems`."""

    def __init__(self, scenario: Scenario, factory: ComponentFactory) -> None:
        self.root, self.spec, self.assignments = scenario.root, scenario.spec, scenario.assignments
        self.problems: list[Problem] = list(scenario.problems)
        self._component_factory = factory
        self.components: dict[str, Component] = {}
        #: variables of the components by their names, without those of the input profiles
        self._variables: dict[str, Mapping[str, Variable]] = {}
        #: names with values that were refused, and the systems in which they are used
        self._refused_values: list[tuple[Node, str]] = []
        #: some signals are missing because of other problems
        self._has_missing_signals = False
        self.start_values: dict[str, dict[str, Any]] = defaultdict(dict)
        #: reasons why optional KPIs and figures are left out
        self.left_out: Sequence[Problem] = ()

    def build_plan(self, real_time: float | None, late: LatePolicy) -> Plan:
        """Complete the system and its settings, and compile them.

        Args:
            real_time: See `Settings`.
            late: See `Settings`.

        Raises:
            InputError: Carries all problems found since the scenario was read.
        """
        for node, name, value, where in iterate_assignments(self.root, self.assignments):
            self._assign(self.start_values, node, name, value, where)
        aliases = self._aliases()
        connections = list(self._connections())
        system = System(
            self.components,
            connections,
            (
                *StagePlanner(self.components, connections).root_stages(self.root, self.spec),
                *([tuple(self.profiles)] if self.profiles else []),
            ),
            dict(self._periods(self.root)),
            self.start_values,
            aliases,
            parallel_mode(self.spec),
        )
        settings = self._settings(aliases, real_time, late)
        try:
            plan = compile_plan(system, settings)
        except InputError as error:
            self.problems += located_problems(self.root, error.problems)
        signals = None if self._has_missing_signals else settings.columns
        resolver = FunctionResolver(self.root, self._variables, self.start_values, signals)
        resolved = resolver.resolve(self.spec)
        self.problems += [
            *resolver.problems,
            *find_function_problems(self.root, self.spec, resolved, signals),
        ]
        self.spec, self.left_out = without_placeholders(resolved), resolver.left_out
        if self.problems:
            raise InputError(merge_problems(self.problems, "unknown component"))
        return plan

    def _settings(
        self, aliases: Mapping[str, Endpoint], real_time: float | None, late: LatePolicy
    ) -> Settings:
        columns = self._columns(aliases)
        stops, problems = read_stop_conditions(
            self.root, self.spec, self.components, columns, not self._has_missing_signals
        )
        self.problems += problems
        return Settings(
            self.spec.start_time,
            self.spec.stop_time,
            self.spec.step_size,
            columns,
            self.spec.record.interval,
            list(self._events()),
            stops,
            non_finite=self.spec.non_finite,
            real_time=real_time,
            late=late,
        )

    def make_components(self) -> None:
        """Create all components, and the tables of the input profiles.

        Raises:
            InputError: The components have too many scalars.
        """
        scalars, values = 0, values_by_component(self.root, self.assignments)
        for node, name in self.root.leaves():
            full_name = node.full_name(name)
            try:
                creation = Creation(
                    full_name,
                    node.folder,
                    values.get(full_name, {}),
                    node.document.objects.get(("components", name)),
                    self._component_factory,
                )
                component = node.spec.components[name].create(creation)
                self.components[full_name] = component
                self._variables[full_name] = {each.name: each for each in component.variables}
                for warning in component.warnings:
                    place = node.where("components", name, *warning.subject)
                    logging.getLogger(component_log.LOGGER_NAME).warning(
                        "%s", Problem(warning.message, place)
                    )
                scalars += count_scalars(component.variables)
            except InputError as error:
                node.invalid_components.add(name)
                self._add_source_problems(error, node, name)
            noun = f"variables and elements of arrays up to {full_name}"
            require_at_most(MAX_SCALARS, scalars, noun, node.where("components", name))
        self.profiles = [f"{PROFILE_PREFIX}.{i}" for i, _ in accepted(self.spec.inputs)]
        for i, spec in accepted(self.spec.inputs):
            try:
                table = spec.create(self.root.folder, self._targets(spec.to))
                self.components[f"{PROFILE_PREFIX}.{i}"] = table
            except InputError as error:
                self.profiles.remove(f"{PROFILE_PREFIX}.{i}")
                self._add_problems(error, self.root, "inputs", i)

    def _targets(self, columns: Mapping[str, Sequence[str]]) -> dict[str, Variable | None]:
        """Return the first input that each column of a profile feeds.

        None if it is unknown, which the wiring reports.
        """
        return {column: next(self._inputs_of(names), None) for column, names in columns.items()}

    def _inputs_of(self, names: Sequence[str]) -> Iterator[Variable]:
        for name in names:
            with suppress(UnknownNameError):
                for component, prefix in resolve_name(self.root, name, ("inputs",)):
                    variables = self._variables.get(component, {})
                    yield from filter(None, map(variables.get, (prefix, prefix.rpartition("[")[0])))

    def _assign(
        self,
        values: dict[str, dict[str, Any]],
        node: Node,
        name: str,
        value: Any,
        where: str,
        all_elements: bool = False,
    ) -> None:
        try:
            for target in resolve_name(node, name, ("parameters", "inputs"), include_inner=True):
                if target.component in self.components:
                    variables = self._variables[target.component]
                    known = values[target.component]
                    known |= check_assignment(
                        target.component,
                        variables,
                        target.prefix,
                        value,
                        all_elements,
                        None if all_elements else known.get,
                    )
        except (UnknownNameError, ValueError) as error:
            self._refused_values.append((node, name))
            if str(error):
                self.problems.append(Problem(str(error), where))

    def _connections(self) -> Iterator[Connection]:
        inputs_with_values: set[Endpoint] = set()
        for name, values in self.start_values.items():
            for variable in map(self._variables[name].__getitem__, values):
                inputs_with_values |= {Endpoint(name, slot) for slot in variable.scalar_names}
        wiring = Wiring(self.components, inputs_with_values)
        for node in self.root.walk():
            wiring.connect(node)
        for i, spec in accepted(self.spec.inputs):
            profile = f"{PROFILE_PREFIX}.{i}"
            for column, names in spec.to.items():
                for name in names:
                    if profile in self.components:
                        wiring.connect_output(
                            self.root,
                            Endpoint(profile, column),
                            name,
                            self.root.where("inputs", i, "to", column),
                        )
                    else:
                        wiring.excuse(self.root, name)
        for node, name in self._refused_values:
            wiring.excuse(node, name)
        yield from wiring.connections()
        self.problems += wiring.problems

    def _periods(
        self, node: Node, inherited: Fraction | None = None
    ) -> Iterator[tuple[str, Fraction]]:
        """Yield (full name, period in s) of all components with an own or inherited period."""
        for name, spec in node.spec.components.items():
            period = spec.period or inherited
            if name in node.children:
                yield from self._periods(node.children[name], period)
            elif period and node.full_name(name) in self.components:
                yield node.full_name(name), period

    def _aliases(self) -> dict[str, Endpoint]:
        """Return the outputs of nested systems by the full names of their ports."""
        aliases: dict[str, Endpoint] = {}
        for node in self.root.walk():
            for name, child in node.children.items():
                for port, inner in child.ports.outputs.items():
                    where = child.where("ports", "outputs", port)
                    alias = f"{node.full_name(name)}.{port}"
                    if port in child.spec.components:
                        text = (
                            f'"{port}" is already the name of a component here, so an output port '
                            "cannot have it"
                        )
                        self.problems.append(Problem(text, where))
                    ends = self._port_outputs(child, inner, where)
                    if ends is None:
                        child.invalid_ports.add(port)
                        continue
                    aliases |= {alias + rest: end for rest, end in ends.items()}
                    require_at_most(
                        MAX_SCALARS, len(aliases), f"signals of output ports up to {alias}", where
                    )
        return aliases

    def _port_outputs(self, node: Node, inner: str, where: str) -> dict[str, Endpoint] | None:
        """Return the outputs of an output port by their names after the prefix.

        None if its component is invalid.

        A port without outputs is a problem only where it is used. Thus a component with fewer
        outputs can replace another one.
        """
        try:
            (target,) = resolve_name(node, inner, ("outputs",))
        except UnknownNameError as error:
            if str(error):
                self.problems.append(Problem(str(error), where))
            return None
        if target.component not in self.components:
            return None
        slots = SlotIndex(self.components[target.component], "output").below(target.prefix)
        return {rest: Endpoint(target.component, slot) for rest, slot in slots.items()}

    def _columns(self, aliases: Mapping[str, Endpoint]) -> dict[str, Endpoint]:
        invalid = [
            node.full_name(name) for node in self.root.walk() for name in node.invalid_components
        ]
        for node in self.root.walk():
            invalid += [f"{node.prefix}.{port}" for port in node.invalid_ports]
            if node.invalid_keys & {"components", "ports"} or node.has_wrong_names:
                invalid.append(node.prefix)
        patterns = [
            (text, self.root.where("record", "signals", i))
            for i, text in enumerate(self.spec.record.signals)
        ]
        columns, problems = select_signals(self.components, aliases, patterns, invalid)
        self.problems += problems
        self._has_missing_signals = bool(invalid or problems or "record" in self.root.invalid_keys)
        return columns

    def _events(self) -> Iterator[Event]:
        for i, spec in accepted(self.spec.events):
            values: dict[str, dict[str, Any]] = defaultdict(dict)
            for name, value in spec.values.items():
                self._assign(
                    values,
                    self.root,
                    name,
                    value,
                    self.root.where("events", i, "set", name),
                    all_elements=True,
                )
            yield Event(spec.time, values, self.root.where("events", i))

    def _add_problems(self, error: InputError, node: Node, *path: str | int) -> None:
        """Add the problems of an error; those without a location get that of a part of `node`."""
        self.problems += [
            replace(problem, where=node.where(*path, *problem.subject), subject=())
            if problem.subject or not problem.where
            else problem
            for problem in error.problems
        ]

    def _add_source_problems(self, error: InputError, node: Node, name: str) -> None:
        """Add the problems of a component.

        Those without a subject belong to its source if the caller has set the source.
        """
        path = ("components", name, node.spec.components[name].KEY)
        where = node.where(*path) if path in node.document.settings else ""
        problems = [
            each if each.subject else replace(each, where=each.where or where)
            for each in error.problems
        ]
        self._add_problems(InputError(problems), node, "components", name)


#: settings whose times must fit the communication points
_TIMED_SETTINGS = (("stop_time",), ("record",), ("events",))
_STEPS = (("period",), ("step_size",))


def located_problems(root: Node, problems: Iterable[Problem]) -> Iterator[Problem]:
    """Yield the problems of a system with their locations.

    Those that follow from invalid times are left out.

    Args:
        root: The scenario.
        problems: Problems that `check_run` found.
    """
    has_invalid_times = not root.invalid_keys.isdisjoint(("stop_time", "step_size", "start_time"))
    for problem in problems:
        key, rest = problem.subject[:1], problem.subject[1:]
        is_timed = key in _TIMED_SETTINGS or problem.subject[-1:] in _STEPS
        if has_invalid_times and is_timed:
            continue
        where = problem.where
        if not where and key == ("components",) and rest:
            where = root.where_component(*rest)
        if not where and key:
            where = root.where(*problem.subject)
        yield problem if problem.where else Problem(problem.message, where)


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
