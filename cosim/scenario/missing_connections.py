"""Inputs that nothing feeds or sets, although they probably lack a connection.

Outputs that have the names of inputs, in the file in which the connection is missing, are the
connections that a warning proposes.
"""

import difflib
import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence, Set
from functools import cached_property
from itertools import chain
from typing import NamedTuple

from ..core.component import Variable, scalars_of
from ..core.errors import abbreviate_names
from ..core.system import Endpoint, System, incompatibility
from .nested_systems import Node
from .system_builder import PROFILE_PREFIX

VariablesByEndpoint = dict[Endpoint, Variable]


class Place(NamedTuple):
    """Scalar as connections name it.

    The enclosing system, its component or nested system, and the name below that.
    """

    system: str
    member: str
    scalar: str

    @property
    def member_name(self) -> str:
        """Full name of the component or nested system."""
        return f"{self.system}.{self.member}" if self.system else self.member

    def __str__(self) -> str:
        return f"{self.member_name}.{self.scalar}"


class MissingConnection(NamedTuple):
    """Connection that would feed unconnected inputs of one component or nested system.

    Attributes:
        target: Input or prefix of inputs.
        sources: All outputs or prefixes of outputs that fit; those of the same vehicle come first.
        inputs: The inputs, with the scalars of components behind them.
    """

    target: str
    sources: Sequence[str]
    inputs: Mapping[Place, Sequence[Endpoint]]


class OutputFinder:
    """Finder of outputs that fit inputs.

    Args:
        root: The scenario.
        system: Its system.
    """

    def __init__(self, root: Node, system: System) -> None:
        self._root, self._system = root, system

    def place_of(self, end: Endpoint) -> Place:
        """Return the outermost name of an input: that of a port if a nested system publishes it."""
        *systems, member = end.component.split(".")
        scalar = end.scalar
        nodes = [self._root]
        for system in systems:
            nodes.append(nodes[-1].children[system])
        while systems and (port := _port_of(nodes.pop(), f"{member}.{scalar}")):
            member, scalar = systems.pop(), port
        return Place(".".join(systems), member, scalar)

    def outputs_beside(self, place: Place) -> Iterator[tuple[Place, Variable]]:
        """Yield the outputs that can be connected in the file of an input, with their variables."""
        for output, variable in self._outputs.items():
            if output.system == place.system and output.member != place.member:
                yield output, variable

    def missing_connections(self, unconnected: VariablesByEndpoint) -> Iterator[MissingConnection]:
        """Yield connections for unconnected inputs, the largest of each component first."""
        ends: dict[Place, list[Endpoint]] = defaultdict(list)
        for end in unconnected:
            ends[self.place_of(end)].append(end)
        members: dict[str, list[Place]] = defaultdict(list)
        for place in ends:
            members[place.member_name].append(place)
        for places in members.values():
            pairs: dict[tuple[str, str], list[Place]] = defaultdict(list)
            for place in places:
                for pair in self._pairs(place, [unconnected[end] for end in ends[place]]):
                    pairs[pair].append(place)
            for target, sources, covered in _largest_first(pairs):
                near = [source for source in sources if places[0].member in source.split(".")]
                base = _common_variable([str(place)[len(target) :] for place in covered])
                names = [source + base for source in dict.fromkeys((*near, *sources))]
                yield MissingConnection(
                    target + base, names, {place: ends[place] for place in covered}
                )

    def _pairs(self, place: Place, variables: Sequence[Variable]) -> set[tuple[str, str]]:
        """Return pairs of prefixes (of inputs, of outputs) whose connection would feed an input.

        The names must be equal without the prefix of the input, and without prefixes of the output.
        A last part alone ("x") is no name; as whole name of an input it may follow one prefix of
        outputs. Instead of a nested system a pair has its port.
        """
        first, _, rest = place.scalar.partition(".")
        pairs = set()
        for prefix, name in (
            (place.member_name, place.scalar),
            (f"{place.member_name}.{first}", rest),
        ):
            for source, output, variable in self._outputs_by_end.get((place.system, name), ()):
                prefixes = source.count(".") - output.member_name.count(".")
                is_name = "." in name or prefixes <= (name == place.scalar)
                if (
                    is_name
                    and output.member != place.member
                    and not any(incompatibility(variable, each) for each in variables)
                ):
                    port = (
                        "." + re.split(r"[.\[]", name)[0]
                        if self._nested_systems & {prefix, source}
                        else ""
                    )
                    pairs.add((prefix + port, source + port))
        return pairs

    @cached_property
    def _nested_systems(self) -> Set[str]:
        """Full names of all nested systems, of which connections name ports."""
        return {node.prefix for node in self._root.walk()}

    @cached_property
    def _outputs(self) -> Mapping[Place, Variable]:
        """All outputs of components and ports."""
        outputs: dict[Place, Variable] = {}
        for name, slots in self._system.slots.items():
            system, _, member = name.rpartition(".")
            outputs |= {
                Place(system, member, slot): v
                for slot, (v, _) in slots.items()
                if v.causality == "output"
            }
        for alias, end in self._system.aliases.items():
            outputs[self._place_of_alias(alias)] = self._system.find_element(end).variable
        return outputs

    def _place_of_alias(self, alias: str) -> Place:
        systems: list[str] = []
        node, rest = self._root, alias
        while (name := rest.partition(".")[0]) in node.children:
            systems.append(name)
            node, rest = node.children[name], rest.partition(".")[2]
        return Place(".".join(systems[:-1]), systems[-1], rest)

    @cached_property
    def _outputs_by_end(self) -> Mapping[tuple[str, str], Sequence[tuple[str, Place, Variable]]]:
        """Outputs by system and name without prefixes, each with the prefix that is left out."""
        found: dict[tuple[str, str], list[tuple[str, Place, Variable]]] = defaultdict(list)
        for place, variable in self._outputs.items():
            prefix, rest = place.member_name, place.scalar
            while rest:
                found[place.system, rest].append((prefix, place, variable))
                first, _, rest = rest.partition(".")
                prefix = f"{prefix}.{first}"
        return found


def _port_of(node: Node, name: str) -> str:
    """Return the port that publishes an inner input of a nested system, with the rest of the name.

    "" if there is none.
    """
    for port, prefixes in node.ports.inputs.items():
        for prefix in prefixes:
            if name == prefix or name.startswith((f"{prefix}.", f"{prefix}[")):
                return port + name[len(prefix) :]
    return ""


def _largest_first(
    pairs: Mapping[tuple[str, str], Sequence[Place]],
) -> Iterator[tuple[str, list[str], list[Place]]]:
    """Yield pairs of prefixes, those that feed the most inputs first, until no input is left.

    Each is (prefix of inputs, prefixes of outputs that feed the same inputs, these inputs).
    """
    left = {pair: list(pairs[pair]) for pair in sorted(pairs)}
    while left:
        (target, _), covered = max(left.items(), key=lambda item: len(item[1]))
        sources = [pair[1] for pair in left if pair[0] == target and left[pair] == covered]
        yield target, sources, covered
        for pair, places in list(left.items()):
            left[pair] = [place for place in places if place not in covered]
            if not left[pair]:
                del left[pair]


def _common_variable(ends: Sequence[str]) -> str:
    """Return the variable that ends of names have in common, or "".

    They are one scalar, or elements of one array.
    """
    names = {end.partition("[")[0] for end in ends}
    if len(ends) == 1:
        return ends[0]
    return names.pop() if len(names) == 1 else ""


#: number of inputs, and of outputs that fit them, that a warning names
_MAX_NAMES = 4


def find_missing_connections(
    root: Node, system: System, unconnected: VariablesByEndpoint
) -> Iterator[tuple[str, str]]:
    """Yield (component, text) for each component that probably lacks a connection.

    The component of a connection to ports is the nested system. A pair ("", text) names
    components of which no input is fed.

    An input probably lacks a connection if an output has its name, if outputs feed other elements
    of its vector, or if it is a single number and half of the component's inputs or more (vectors
    count once) are fed or set. Vectors of which no element is fed are often disturbances, a
    vertical component ("force.z") beside horizontal ones that are fed is often 0 on purpose, and
    Booleans are requests that nothing makes.

    Args:
        root: The scenario.
        system: Its system.
        unconnected: Scalar inputs that no connection, start value or event sets, with their
            variables.
    """
    if not unconnected:
        return
    finder, fed_vectors, isolated = OutputFinder(root, system), _fed_vectors(system), []
    explained: set[Endpoint] = set()
    for missing in finder.missing_connections(unconnected):
        explained.update(chain.from_iterable(missing.inputs.values()))
        yield next(iter(missing.inputs)).member_name, _missing_text(missing)
    for name, component in system.components.items():
        inputs = [Endpoint(name, scalar) for scalar in scalars_of(component.variables, "input")]
        unfed = {end: unconnected[end] for end in inputs if end in unconnected}
        suspects = [end for end in _suspects(inputs, unfed, fed_vectors) if end not in explained]
        if unfed and len(unfed) == len(inputs) and explained.isdisjoint(unfed):
            isolated.append(name)
        elif suspects:
            hint = _hint(finder, len(suspects), finder.place_of(suspects[0]), unfed[suspects[0]])
            yield (
                name,
                f"nothing feeds or sets {abbreviate_names(map(str, suspects), _MAX_NAMES)}{hint}",
            )
    if isolated and system.connections:
        yield (
            "",
            f"nothing feeds or sets an input of {', '.join(isolated)}: are connections missing?",
        )


def _missing_text(missing: MissingConnection) -> str:
    *others, last = (
        missing.sources
        if len(missing.sources) <= _MAX_NAMES
        else [abbreviate_names(missing.sources, _MAX_NAMES)]
    )
    sources = f"{', '.join(others)} or {last}" if others else last
    names = abbreviate_names(map(str, missing.inputs), _MAX_NAMES)
    return (
        f"nothing feeds or sets {names}: is a connection from {sources} to {missing.target} "
        "missing?"
    )


def _fed_vectors(system: System) -> set[Endpoint]:
    """Return the vectors of inputs that outputs of other components feed, as a whole or in part."""
    prefix = f"{PROFILE_PREFIX}."
    ends = (c.target for c in system.connections if not c.source.component.startswith(prefix))
    return {Endpoint(end.component, _vector(end.scalar)) for end in ends if _vector(end.scalar)}


def _suspects(
    inputs: list[Endpoint], unfed: VariablesByEndpoint, fed_vectors: set[Endpoint]
) -> list[Endpoint]:
    """Return the unfed inputs that probably lack a connection, whatever the outputs are."""
    groups = {_vector(end.scalar) or end.scalar for end in inputs}
    unfed_groups = {_vector(end.scalar) or end.scalar for end in unfed}
    is_mostly_fed = 2 * len(groups - unfed_groups) >= len(groups)
    suspects = []
    for end, variable in unfed.items():
        vector = _vector(end.scalar)
        lacks_element = (end.component, vector) in fed_vectors and not end.scalar.endswith(".z")
        is_scalar = not vector and variable.type != "Boolean"
        if lacks_element or (is_mostly_fed and is_scalar):
            suspects.append(end)
    return suspects


def _vector(slot: str) -> str:
    """Return the name of the vector that a scalar belongs to, with its separator.

    "motor[" of "motor[1]"; "" if there is none.
    """
    return slot[: max(slot.rfind("."), slot.rfind("[")) + 1]


def _hint(finder: OutputFinder, count: int, place: Place, variable: Variable) -> str:
    """Return the end of a warning about a number of inputs.

    The output with the name nearest to that of the first input.
    """
    keep = "they keep their start values" if count > 1 else "it keeps its start value"
    outputs = {
        output.scalar: output
        for output, other in finder.outputs_beside(place)
        if not incompatibility(other, variable)
    }
    near = difflib.get_close_matches(place.scalar, outputs, n=1)
    nearest = f"; the output nearest by name is {outputs[near[0]]}" if near else ""
    return (
        f': {keep} until a connection feeds or "parameters" set '
        f"{'them' if count > 1 else 'it'}{nearest}"
    )
