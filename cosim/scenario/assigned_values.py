"""Values that a scenario and its caller assign to variables, before the components exist."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

from .name_resolution import UnknownNameError, resolve_name
from .nested_systems import Node


class Assignment(NamedTuple):
    """Assignment of a value to the variable `name` in the system `node`.

    `where` is its place, for messages.
    """

    node: Node
    name: str
    value: Any
    where: str


def iterate_assignments(root: Node, settings: Mapping[str, Any]) -> Iterator[Assignment]:
    """Yield the assignments of start values.

    Outer systems override nested ones, and the caller's settings override both.
    """
    for node in root.walk():
        for name, spec in node.spec.components.items():
            for variable, value in spec.parameters.items():
                yield Assignment(
                    node,
                    f"{name}.{variable}",
                    value,
                    node.where("components", name, "parameters", variable),
                )
    for name, value in settings.items():
        yield Assignment(root, name, value, f'setting "{name}"')


def values_by_component(root: Node, settings: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the assigned values by full name of the component and name of the variable.

    Unknown names are left out.
    """
    values: dict[str, dict[str, Any]] = defaultdict(dict)
    for node, name, value, _ in iterate_assignments(root, settings):
        with suppress(UnknownNameError):
            for target in resolve_name(node, name, ("parameters", "inputs"), include_inner=True):
                values[target.component][target.prefix] = value
    return values
