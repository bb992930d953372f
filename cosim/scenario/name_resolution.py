"""Resolution of the names in a scenario to components and their variables."""

import re
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from ..core.component import Component, Variable, scalars_of
from ..core.errors import abbreviate_names, did_you_mean
from .nested_systems import Node
from .schema import ScenarioSpec
from .variable_values import check_value, quote_value, start_values


class UnknownNameError(Exception):
    """A name that refers to nothing.

    Its text gives the reason, and is empty if the reason has already been reported.
    """


class Target(NamedTuple):
    """Variable of a component, or prefix of several; the prefix "" means the whole component."""

    component: str
    prefix: str


def resolve_name(
    node: Node, text: str, ports: Sequence[str], include_inner: bool = False
) -> list[Target]:
    """Resolve a name in a system to variables of components.

    Args:
        node: The system in which the name is used.
        text: A name such as "uav.position"; its first part is a component.
        ports: The kinds of ports by which a nested system is entered ("inputs", "outputs",
            "parameters").
        include_inner: Accept the names of components inside nested systems as well as ports.

    Raises:
        UnknownNameError: The name refers to nothing.
    """
    component, _, rest = text.partition(".")
    if component in node.invalid_components or "components" in node.invalid_keys:
        raise UnknownNameError
    if component not in node.spec.components:
        if node.has_wrong_names:
            raise UnknownNameError
        is_removed = ("components", component) in node.document.removed
        hint = (
            ", which was removed" if is_removed else did_you_mean(component, node.spec.components)
        )
        if component in ScenarioSpec.model_fields:
            hint = (
                f'; "{component}" is an entry of the scenario, name it by a JSON pointer: '
                f'"/{component}/..."'
            )
        raise UnknownNameError(f'unknown component "{component}"{hint}')
    child = node.children.get(component)
    if child is None:
        return [Target(node.full_name(component), rest)]
    if not rest:
        raise UnknownNameError(
            f'"{text}" names a nested system, expected one of its '
            f"ports{did_you_mean('', _port_targets(child, ports))}"
        )
    port = re.split(r"[.\[]", rest, maxsplit=1)[0]
    if port in child.invalid_ports and "outputs" in ports:
        raise UnknownNameError
    inner_names = _port_targets(child, ports)
    if port in inner_names:
        targets: list[Target] = []
        for inner in inner_names[port]:
            targets += resolve_name(child, inner + rest[len(port) :], ports, include_inner)
        return targets
    if include_inner and port in {*child.spec.components, *child.invalid_components}:
        return resolve_name(child, rest, ports, include_inner)
    if "ports" in child.invalid_keys:
        raise UnknownNameError
    valid = [*inner_names, *(child.spec.components if include_inner else ())]
    raise UnknownNameError(
        f'nested system "{component}" has no {ports[0].rstrip("s")} port '
        f'"{port}"{did_you_mean(port, valid)}'
    )


def _port_targets(node: Node, kinds: Sequence[str]) -> Mapping[str, Sequence[str]]:
    """Return the inner names of every port of the given kinds."""
    targets = {}
    for kind in kinds:
        for name, inner in getattr(node.ports, kind).items():
            targets[name] = [inner] if isinstance(inner, str) else inner
    return targets


class PrefixIndex:
    """Sorted names that are searched by prefix in logarithmic time."""

    def __init__(self, names: Iterable[str]):
        self._sorted = sorted(names)

    def with_prefix(self, prefix: str) -> Sequence[str]:
        """Return all names that start with `prefix`, sorted."""
        if not prefix:
            return self._sorted
        begin = bisect_left(self._sorted, prefix)
        return self._sorted[
            begin : bisect_left(self._sorted, prefix[:-1] + chr(ord(prefix[-1]) + 1), begin)
        ]


class SlotIndex:
    """Scalars of the variables of one causality of a component, searched by prefix."""

    def __init__(self, component: Component, causality: str):
        scalars = scalars_of(component.variables, causality)
        self._positions = {scalar: position for position, scalar in enumerate(scalars)}
        self._names = PrefixIndex(self._positions)

    def below(self, prefix: str) -> dict[str, str]:
        """Return the scalars below a prefix, keyed by their names after the prefix.

        The key is "" for the prefix itself, and for example ".position.x" below it. In a pattern
        such as "pos_*", "*" matches one or more characters, which are the key. The order is that of
        the variables.
        """
        if not prefix:
            return {f".{slot}": slot for slot in self._positions}
        head, star, tail = prefix.partition("*")
        if star:
            fixed = len(head) + len(tail)
            found = (
                slot
                for slot in self._names.with_prefix(head)
                if len(slot) > fixed and slot.endswith(tail)
            )
            return {
                slot[len(head) : len(slot) - len(tail)]: slot
                for slot in sorted(found, key=self._positions.__getitem__)
            }
        slots = [prefix] if prefix in self._positions else []
        for separator in ".[":
            slots += self._names.with_prefix(prefix + separator)
        return {
            slot[len(prefix) :]: slot for slot in sorted(slots, key=self._positions.__getitem__)
        }


def check_assignment(
    name: str,
    variables: Mapping[str, Variable],
    text: str,
    value: Any,
    all_elements: bool = False,
    current: Callable[[str], Sequence[Any] | None] | None = None,
) -> dict[str, Any]:
    """Check the assignment `text` = `value` and return the checked values by variable name.

    A list sets an array variable, the scalar variables text[1], text[2], ..., or a vector:
    text.x, text.y, ...
    A scalar sets a variable or one element of an array variable.

    Args:
        name: The component's name, for messages.
        variables: The component's variables by name.
        text: The name of a variable, or of a list of variables without their indices.
        value: The value from the scenario or from a Python caller.
        all_elements: Refuse a list that is shorter than the array. By default the other elements
            keep their start values.
        current: Returns the present elements of an array variable, which the assignment of one
            element keeps; None stands for
            the start values. Without it, elements are refused (events).

    Raises:
        UnknownNameError: The component has no such variable.
        ValueError: The variable does not accept the value.
    """
    value = value.tolist() if hasattr(value, "tolist") else value
    array = text.rpartition("[")[0]
    if array in variables and text not in variables and text in variables[array].scalar_names:
        return {array: _with_element(variables[array], text, value, current)}
    if text in variables:
        return {text: check_value(variables[text], value, all_elements)}
    names: Sequence[str] = ()
    if f"{text}[1]" in variables:
        if not isinstance(value, list) or not value:
            raise ValueError(f'"{text}" is a list of values, found {quote_value(value)}')
        names = [f"{text}[{i}]" for i in range(1, len(value) + 1)]
        if names[-1] not in variables:
            size = sum(other.startswith(f"{text}[") for other in variables)
            raise ValueError(f'"{text}" takes at most {size} values, found {len(value)}')
    elif isinstance(value, list):
        names = vector_names(variables, text)
        if names and len(value) != len(names):
            raise ValueError(f'"{text}" takes {len(names)} values, found {len(value)}')
    if names:
        return {
            each: check_value(variables[each], element)
            for each, element in zip(names, value, strict=True)
        }
    settable: list[str] = []
    for causality in ("parameter", "input"):
        settable += [v.name for v in variables.values() if v.causality == causality]
    valid = abbreviate_names(re.sub(r"\[\d+\]$", "", each) for each in settable)
    hint = did_you_mean(text, settable) or (valid and f"; valid: {valid}")
    raise UnknownNameError(f'component "{name}" has no variable "{text}"{hint}')


def _with_element(
    variable: Variable,
    element: str,
    value: Any,
    current: Callable[[str], Sequence[Any] | None] | None,
) -> list[Any]:
    """Return the elements of an array of which one is assigned."""
    if current is None:
        raise ValueError(
            f'"{element}" is an element, an event sets the whole array: expected a list for '
            f'"{variable.name}"'
        )
    elements = current(variable.name)
    elements = list(start_values(variable) if elements is None else elements)
    elements[variable.scalar_names.index(element)] = value
    return list(check_value(variable, elements, all_elements=True))


def vector_names(variables: Mapping[str, Variable], prefix: str) -> list[str]:
    """Return the scalar variables of a vector (prefix.x, prefix.y, prefix.z) in their order.

    They have the same type, unit and causality. The list is empty if the prefix names no vector.
    """
    begin = f"{prefix}."
    found = [
        each
        for name, each in variables.items()
        if name.startswith(begin) and not re.search(r"[.\[]", name[len(begin) :])
    ]
    kinds = {(each.type, each.unit, each.causality, each.shape) for each in found}
    return (
        [each.name for each in found]
        if len(found) > 1 and len(kinds) == 1 and not found[0].shape
        else []
    )


#: system, name of the variable in it, value, and place for messages
Assignment = tuple[Node, str, Any, str]


def iterate_assignments(root: Node, settings: Mapping[str, Any]) -> Iterator[Assignment]:
    """Yield the assignments of start values.

    Outer systems override nested ones, and the caller's settings override both.
    """
    for node in root.walk():
        for name, spec in node.spec.components.items():
            for variable, value in spec.parameters.items():
                where = node.where("components", name, "parameters", variable)
                yield node, f"{name}.{variable}", value, where
    for name, value in settings.items():
        yield root, name, value, f'setting "{name}"'


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
