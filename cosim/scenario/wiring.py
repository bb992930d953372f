"""Expansion of the connections of a scenario, which may use prefixes, to connections of scalars."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from itertools import chain, starmap
from typing import NamedTuple

from ..core.component import Component, Variable, scalars_of
from ..core.errors import Problem, abbreviate_names, did_you_mean
from ..core.size_limits import MAX_CONNECTIONS, require_at_most
from ..core.system import Connection, Endpoint, incompatibility
from .name_resolution import SlotIndex, Target, UnknownNameError, resolve_name
from .nested_systems import Node
from .schema import ConnectionSpec
from .schema_types import INVALID, accepted

#: words of the problem of an input that a prefix or a pattern does not feed
NO_MATCHING_OUTPUT = "has no matching output"
#: number of connections that a hint lists
_MAX_PAIRS = 4


class _Candidate(NamedTuple):
    """Connections to an input, several for a sum.

    `is_variable`: the scenario names their variables instead of prefixes.
    """

    connections: Sequence[Connection]
    is_variable: bool


class _Source(NamedTuple):
    """Prefix or pattern of outputs, and the outputs by their names after the prefix."""

    target: Target
    outputs: Mapping[str, str]

    def expected_name(self, rest: str) -> str:
        """Return the name of the output that matches an input with this name after the prefix."""
        component, prefix = self.target
        name = prefix.replace("*", rest) if "*" in prefix else prefix + rest
        return f"{component}.{name}".replace("..", ".")

    def unmatched(self, end: Endpoint, rest: str, hint: str, where: str) -> Problem:
        """Return the problem of an input without a matching output."""
        return Problem(f"input {end} {NO_MATCHING_OUTPUT} {self.expected_name(rest)}{hint}", where)


def _kind_of_names(names: Iterable[str]) -> str:
    """Return the kind of names: "array" ("[1]"), "vector" (".x"), or ""."""
    kinds = {"array": re.compile(r"\[\d+\]"), "vector": re.compile(r"\.\w+")}
    names = list(names)
    return next(
        (kind for kind, form in kinds.items() if names and all(map(form.fullmatch, names))), ""
    )


class Wiring:
    """Expander of the connections of a scenario and its nested systems.

    `problems` collects those that are invalid.

    A prefix connects every input below it to the output with the same name after the prefix. Two
    patterns with "*" connect every input to the output with the same text at the "*". An input
    without such an output is a problem unless it has a value or another connection. A connection of
    single variables overrides those of prefixes and patterns.

    Args:
        components: The components by full name.
        inputs_with_values: Scalar inputs that the scenario sets to a value.
    """

    def __init__(
        self, components: Mapping[str, Component], inputs_with_values: set[Endpoint]
    ) -> None:
        self._components = components
        self._inputs_with_values = inputs_with_values
        self._slots: dict[tuple[str, str], SlotIndex] = {}
        self._by_input: dict[Endpoint, _Candidate] = {}
        self._unmatched_inputs: dict[Endpoint, Problem] = {}
        #: connections so far, including those that are overridden or invalid
        self._count = 0
        #: inputs whose missing connection another problem explains, and whether an invalid
        #: connection may explain any
        self._excused: set[Endpoint] = set()
        self._has_invalid_connections = False
        self.problems: list[Problem] = []

    def connect(self, node: Node) -> None:
        """Expand the connections of one system, without those of its nested systems."""
        self._has_invalid_connections |= any(spec is INVALID for spec in node.spec.connections)
        for i, spec in accepted(node.spec.connections):
            self._expand(node, i, spec)

    def connect_output(self, node: Node, output: Endpoint, name: str, where: str) -> None:
        """Connect one output to the inputs that a name refers to.

        `where` is its location in the scenario file.
        """
        for target in self._resolve(node, name, "inputs", where):
            self._add(_Candidate([Connection(output, Endpoint(*target), 0, where)], True))

    def excuse(self, node: Node, name: str) -> None:
        """Do not report missing outputs for inputs whose reason is another problem."""
        with suppress(UnknownNameError):
            for target in resolve_name(node, name, ("inputs",), include_inner=True):
                if target.component in self._components:
                    slots = self._slots_of_target(target, "input").values()
                    self._excused.update(Endpoint(target.component, slot) for slot in slots)

    def connections(self) -> Iterator[Connection]:
        """Return all connections, and add the inputs that have no output to the problems."""
        if not self._has_invalid_connections:
            explained = self._by_input.keys() | self._excused
            unmatched = (
                problem for end, problem in self._unmatched_inputs.items() if end not in explained
            )
            self.problems += dict.fromkeys(unmatched)
        return chain.from_iterable(each.connections for each in self._by_input.values())

    def _expand(self, node: Node, i: int, spec: ConnectionSpec) -> None:
        sources: list[_Source] = []
        for k, name in enumerate(spec.sources):
            index = (k,) if len(spec.sources) > 1 else ()
            where = node.where("connections", i, "from", *index)
            sources += starmap(_Source, self._slots_of_name(node, name, "output", where)[:1])
        inputs = self._slots_of_name(node, spec.target, "input", node.where("connections", i, "to"))
        if len(sources) < len(spec.sources):
            self.excuse(node, spec.target)
            return
        where = node.where("connections", i)
        for target, slots in inputs:
            ends = {rest: Endpoint(target.component, slot) for rest, slot in slots.items()}
            for rest, end in ends.items():
                self._match(sources, end, rest, spec, where)
            self._join_problems_of_elements(sources[0], ends, where)

    def _match(
        self, sources: Sequence[_Source], end: Endpoint, rest: str, spec: ConnectionSpec, where: str
    ) -> None:
        """Connect an input to the matching output of each source.

        Its name is the same after the prefix, or at the "*" of a pattern.
        """
        unmatched = [source for source in sources if rest not in source.outputs]
        if unmatched and end not in self._inputs_with_values:
            hint = self._output_hint(unmatched[0], end, rest)
            self._unmatched_inputs[end] = unmatched[0].unmatched(end, rest, hint, where)
        if unmatched:
            return
        connections = [
            Connection(
                Endpoint(source.target.component, source.outputs[rest]),
                end,
                spec.delay,
                where,
                gain,
                0.0 if i else spec.offset,
                i + 1 if len(sources) > 1 else 0,
                spec.convert,
                spec.interpolation,
            )
            for i, (source, gain) in enumerate(zip(sources, spec.gains, strict=True))
        ]
        self._add(_Candidate(connections, is_variable=rest == ""))

    def _join_problems_of_elements(
        self, source: _Source, ends: Mapping[str, Endpoint], where: str
    ) -> None:
        """Report inputs once if they and the outputs are an array and components of a vector.

        The problem names the connections to write.
        """
        outputs = [Endpoint(source.target.component, slot) for slot in source.outputs.values()]
        kinds = {_kind_of_names(source.outputs), _kind_of_names(ends)}
        unmatched = {rest: end for rest, end in ends.items() if end in self._unmatched_inputs}
        if kinds != {"array", "vector"} or len(outputs) != len(ends) or not unmatched:
            return
        pairs = list(zip(outputs, ends.values(), strict=True))
        if all(self._fits(*pair) for pair in pairs):
            hint = abbreviate_names((f"{output} to {end}" for output, end in pairs), _MAX_PAIRS)
            rest, first = next(iter(unmatched.items()))
            problem = source.unmatched(first, rest, f"; connect {hint}", where)
            self._unmatched_inputs.update(dict.fromkeys(unmatched.values(), problem))

    def _output_hint(self, source: _Source, end: Endpoint, rest: str) -> str:
        """Return a hint at outputs that fit an input.

        Of a similar name below the prefix, or of other components.
        """
        outputs = {
            name: Endpoint(source.target.component, slot) for name, slot in source.outputs.items()
        }
        outputs = {name: output for name, output in outputs.items() if self._fits(output, end)}
        if not rest.startswith("."):
            return did_you_mean(source.expected_name(rest), map(str, outputs.values()))
        if _kind_of_names(outputs) == "array":
            return f"; valid: {abbreviate_names(map(str, outputs.values()), _MAX_PAIRS)}"
        hint = did_you_mean(rest[1:], (name[1:] for name in outputs))
        same = (
            output
            for output, variable in self._variables.items()
            if str(output).endswith(rest)
            and variable.causality == "output"
            and output.component != end.component
            and self._fits(output, end)
            and "did you mean" not in hint
        )
        return next((f"; connect {output} to it" for output in same), hint)

    def _fits(self, output: Endpoint, end: Endpoint) -> bool:
        return not incompatibility(self._variables[output], self._variables[end])

    @cached_property
    def _variables(self) -> Mapping[Endpoint, Variable]:
        """Variables of all components by their scalars."""
        variables = {}
        for name, component in self._components.items():
            for scalar, variable in scalars_of(component.variables).items():
                variables[Endpoint(name, scalar)] = variable
        return variables

    def _add(self, new: _Candidate) -> None:
        first = new.connections[0]
        self._count += len(new.connections)
        require_at_most(
            MAX_CONNECTIONS, self._count, "connections of scalars up to here", first.where
        )
        end = first.target
        old = self._by_input.get(end)
        if old and old.is_variable == new.is_variable:
            text = (
                f"input {end} is connected twice: it is already fed by {old.connections[0].source}"
            )
            self.problems.append(Problem(text, first.where))
        elif old is None or new.is_variable:
            self._by_input[end] = new

    def _resolve(self, node: Node, name: str, kind: str, where: str) -> list[Target]:
        try:
            return [t for t in resolve_name(node, name, (kind,)) if t.component in self._components]
        except UnknownNameError as error:
            if str(error):
                self.problems.append(Problem(str(error), where))
            return []

    def _slots_of_name(
        self, node: Node, name: str, causality: str, where: str
    ) -> list[tuple[Target, dict[str, str]]]:
        """Return the scalars of a causality below each prefix that a name refers to.

        Add a problem if there are none at all.
        """
        targets = self._resolve(node, name, f"{causality}s", where)
        slots_by_target = [(target, self._slots_of_target(target, causality)) for target in targets]
        if targets and not any(slots for _, slots in slots_by_target):
            self.problems.append(Problem(self._no_slots_message(targets[0], causality), where))
        return [(target, slots) for target, slots in slots_by_target if slots]

    def _slots_of_target(self, target: Target, causality: str) -> dict[str, str]:
        key = target.component, causality
        if key not in self._slots:
            self._slots[key] = SlotIndex(self._components[target.component], causality)
        return self._slots[key].below(target.prefix)

    def _no_slots_message(self, target: Target, causality: str) -> str:
        component = self._components[target.component]
        for other in ("input", "output", "parameter"):
            if other != causality and self._slots_of_target(target, other):
                return f"{target.component}.{target.prefix} is an {other}, expected an {causality}"
        valid = (v.name for v in component.variables if v.causality == causality)
        return (
            f'component "{target.component}" has no {causality} '
            f'"{target.prefix}"{did_you_mean(target.prefix, valid)}'
        )
