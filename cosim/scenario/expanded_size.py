"""Size of an expanded scenario, computed without expanding its nested systems."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any

from ..core.size_limits import (
    MAX_COMPONENTS,
    MAX_CONNECTIONS,
    MAX_DELAYED_VALUES,
    MAX_SCALARS,
    require_at_most,
)
from .json_document import Document
from .schema import ScenarioSpec, SystemSpec, ports_of
from .schema_types import accepted

#: kinds of ports through which a connection and a value of a parameter enter a nested system
CONNECTION_PORTS, VALUE_PORTS = ("inputs",), ("parameters", "inputs")


@dataclass(eq=False)
class SystemFile:
    """Scenario file or file of a nested system, read once for all its instances.

    Attributes:
        document: The file's JSON.
        spec: Its valid parts.
        invalid_keys: Keys that are invalid or missing.
        invalid_components: Components whose entries are invalid.
        children: Files of the nested systems, by component name.
    """

    document: Document
    spec: SystemSpec
    invalid_keys: set[str]
    invalid_components: set[str]
    children: dict[str, SystemFile]

    @cached_property
    def levels(self) -> int:
        """Number of nested levels, including this one."""
        return 1 + max((child.levels for child in self.children.values()), default=0)

    @cached_property
    def components(self) -> int:
        """Number of components and nested systems."""
        return len(self.spec.components) + sum(child.components for child in self.children.values())

    @cached_property
    def connections(self) -> int:
        """Number of connections and output ports.

        A connection to an input port counts once for each of its readers.
        """
        own = 0
        for _, spec in accepted(self.spec.connections):
            own += len(spec.sources) * self._count_targets(spec.target, CONNECTION_PORTS)
        profiles = self.spec.inputs if isinstance(self.spec, ScenarioSpec) else ()
        for _, profile in accepted(profiles):
            for name in chain.from_iterable(profile.to.values()):
                own += self._count_targets(name, CONNECTION_PORTS)
        return (
            own
            + len(ports_of(self.spec).outputs)
            + sum(child.connections for child in self.children.values())
        )

    @cached_property
    def delayed_values(self) -> int:
        """Number of values that all delays store, if every delayed connection is one of scalars."""
        own = sum(spec.delay * len(spec.sources) for _, spec in accepted(self.spec.connections))
        return own + sum(child.delayed_values for child in self.children.values())

    @cached_property
    def assigned_values(self) -> int:
        """Number of values that parameters and events set; a list counts with all its elements."""
        own = sum(
            self._count_targets(name, VALUE_PORTS) * (len(value) if isinstance(value, list) else 1)
            for name, value in self._assignments()
        )
        return own + sum(child.assigned_values for child in self.children.values())

    def _assignments(self) -> Iterator[tuple[str, Any]]:
        """Yield (name, value) of all parameters and events of this file."""
        for component, spec in self.spec.components.items():
            yield from (
                (f"{component}.{variable}", value) for variable, value in spec.parameters.items()
            )
        if isinstance(self.spec, ScenarioSpec):
            for _, event in accepted(self.spec.events):
                yield from event.values.items()

    def _count_targets(self, text: str, kinds: Sequence[str]) -> int:
        """Return the number of inner names that a name refers to.

        A nested system counts as its largest port.
        """
        name, _, rest = text.partition(".")
        child = self.children.get(name)
        if child is None:
            return 1
        targets = child._targets_by_port[kinds]
        port = re.split(r"[.\[]", rest, maxsplit=1)[0]
        if port:
            return targets[port] if port in targets else child._count_targets(rest, kinds)
        return max(
            1, *targets.values(), *(child._count_targets(inner, kinds) for inner in child.children)
        )

    @cached_property
    def _targets_by_port(self) -> Mapping[Sequence[str], Mapping[str, int]]:
        """Number of inner names of every port, by kinds and port."""
        counts: dict[Sequence[str], dict[str, int]] = {}
        for kinds in (CONNECTION_PORTS, VALUE_PORTS):
            own = counts[kinds] = {}
            for kind in kinds:
                for port, names in getattr(ports_of(self.spec), kind).items():
                    own[port] = sum(self._count_targets(inner, kinds) for inner in names)
        return counts


def check_expanded_size(file: SystemFile) -> None:
    """Compare the size of the expanded scenario with its limits.

    Raises:
        InputError: The scenario exceeds a limit.
    """
    for key, limit, count, noun in (
        ("components", MAX_COMPONENTS, file.components, "components and nested systems"),
        ("connections", MAX_CONNECTIONS, file.connections, "connections and output ports"),
        ("connections", MAX_DELAYED_VALUES, file.delayed_values, "values that delays store"),
        ("components", MAX_SCALARS, file.assigned_values, "values of parameters and events"),
    ):
        require_at_most(
            limit, count, f"{noun} in the expanded scenario", file.document.where((key,))
        )
