"""Connections of a scenario, written with names and prefixes, become connections of single variables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from ..core.component import Component
from ..core.errors import Problem, did_you_mean
from ..core.system import Connection, Endpoint
from .name_resolution import Slots, Target, Unknown, resolve
from .nested_systems import Node
from .schema import ConnectionSpec, kept


class _Candidate(NamedTuple):
    connection: Connection
    single: bool


class Wiring:
    """Expands the connections of a scenario and its nested systems; `problems` holds what could not be wired.

    A prefix connects every input below it to the output with the same rest of the name. An input without such an output is
    a problem unless something else sets it (`set_inputs`) or feeds it. A connection of single variables beats a prefix.
    """

    def __init__(self, components: Mapping[str, Component], set_inputs: set[Endpoint]):
        self._components = components
        self._set_inputs = set_inputs
        self._slots: dict[tuple[str, str], Slots] = {}
        self._fed: dict[Endpoint, _Candidate] = {}
        self._unfed: dict[Endpoint, Problem] = {}
        self.problems: list[Problem] = []

    def connect(self, node: Node) -> None:
        """Expand the connections of one system (not of those nested in it)."""
        for i, spec in kept(node.spec.connections):
            self._expand(node, i, spec)

    def feed(self, node: Node, output: Endpoint, name: str, where: str) -> None:
        """Connect one output to the input(s) that a name means."""
        for target in self._resolve(node, name, "inputs", where):
            self._add(_Candidate(Connection(output, Endpoint(*target), 0, where), True))

    def connections(self) -> Iterator[Connection]:
        """All connections; inputs that stayed without an output are added to the problems."""
        self.problems += [problem for end, problem in self._unfed.items() if end not in self._fed]
        return (candidate.connection for candidate in self._fed.values())

    def _expand(self, node: Node, i: int, spec: ConnectionSpec) -> None:
        where_from, where_to = (node.where("connections", i, key) for key in ("from", "to"))
        sources = self._resolve(node, spec.source, "outputs", where_from)
        targets = self._resolve(node, spec.target, "inputs", where_to)
        outputs = self._under(sources, "output", where_from)
        inputs = self._under(targets, "input", where_to)
        for source, own_outputs in outputs:
            for target, own_inputs in inputs:
                self._match(source, own_outputs, target, own_inputs, spec.delay, node.where("connections", i))

    def _match(
        self,
        source: Target,
        outputs: Mapping[str, str],
        target: Target,
        inputs: Mapping[str, str],
        delay: int,
        where: str,
    ) -> None:
        for rest, slot in inputs.items():
            end = Endpoint(target.component, slot)
            if rest in outputs:
                connection = Connection(Endpoint(source.component, outputs[rest]), end, delay, where)
                self._add(_Candidate(connection, single=rest == ""))
            elif end not in self._set_inputs:
                wanted = f"{source.component}.{source.prefix}{rest}".replace("..", ".")
                hint = did_you_mean(wanted, (f"{source.component}.{name}" for name in outputs.values()))
                self._unfed[end] = Problem(f"input {end} has no matching output {wanted}{hint}", where)

    def _add(self, new: _Candidate) -> None:
        end = new.connection.target
        old = self._fed.get(end)
        if old and old.single == new.single:
            text = f"input {end} is connected twice: it is already fed by {old.connection.source}"
            self.problems.append(Problem(text, new.connection.where))
        elif old is None or new.single:
            self._fed[end] = new

    def _resolve(self, node: Node, name: str, kind: str, where: str) -> list[Target]:
        try:
            return [t for t in resolve(node, name, (kind,)) if t.component in self._components]
        except Unknown as error:
            if str(error):
                self.problems.append(Problem(str(error), where))
            return []

    def _under(self, targets: Sequence[Target], causality: str, where: str) -> list[tuple[Target, dict[str, str]]]:
        """Slots of the wanted causality below each prefix; a problem if there are none at all."""
        found = [(target, self._below(target, causality)) for target in targets]
        if targets and not any(slots for _, slots in found):
            self.problems.append(Problem(self._nothing_under(targets[0], causality), where))
        return [(target, slots) for target, slots in found if slots]

    def _below(self, target: Target, causality: str) -> dict[str, str]:
        key = target.component, causality
        if key not in self._slots:
            self._slots[key] = Slots(self._components[target.component], causality)
        return self._slots[key].under(target.prefix)

    def _nothing_under(self, target: Target, causality: str) -> str:
        component = self._components[target.component]
        for other in ("input", "output", "parameter"):
            if other != causality and self._below(target, other):
                return f"{target.component}.{target.prefix} is an {other}, expected an {causality}"
        valid = (v.name for v in component.variables if v.causality == causality)
        return f'component "{target.component}" has no {causality} "{target.prefix}"{did_you_mean(target.prefix, valid)}'
