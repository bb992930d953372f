"""From names in a scenario to components and their variables."""

from __future__ import annotations

import json
import re
import sys
from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..core.component import Component, Variable
from ..core.errors import did_you_mean
from .nested_systems import Node

_PORT = re.compile(r"[^.\[]*")
_REALS = ("Float64", "Float32")


class UnknownName(Exception):
    """A name refers to nothing; the text says why. Empty when the reason was reported elsewhere."""


class Target(NamedTuple):
    """A variable, or a prefix of variables, of a component; "" is the whole component."""

    component: str
    prefix: str


def resolve_name(node: Node, text: str, ports: Sequence[str], include_inner: bool = False) -> list[Target]:
    """What a name means in a system. Through a nested system it goes by its ports of the given kinds ("inputs", ...); with
    `hidden`, inner components are reached by their own names too.

    Raises Unknown.
    """
    component, _, rest = text.partition(".")
    if component in node.invalid_components or "components" in node.invalid_keys:
        raise UnknownName
    if component not in node.spec.components:
        raise UnknownName(f'unknown component "{component}"{did_you_mean(component, node.spec.components)}')
    child = node.children.get(component)
    if child is None:
        return [Target(node.full_name(component), rest)]
    if not rest:
        raise UnknownName(
            f'"{text}" names a nested system, expected one of its ports{did_you_mean("", _port_targets(child, ports))}'
        )
    match = _PORT.match(rest)
    port = match.group() if match else ""
    shown = _port_targets(child, ports)
    if port in shown:
        return [
            target for inner in shown[port] for target in resolve_name(child, inner + rest[len(port) :], ports, include_inner)
        ]
    if include_inner and port in {*child.spec.components, *child.invalid_components}:
        return resolve_name(child, rest, ports, include_inner)
    valid = [*shown, *(child.spec.components if include_inner else ())]
    raise UnknownName(f'nested system "{component}" has no {ports[0].rstrip("s")} port "{port}"{did_you_mean(port, valid)}')


def _port_targets(node: Node, kinds: Sequence[str]) -> Mapping[str, Sequence[str]]:
    declared = getattr(node.spec, "ports", None)
    shown: dict[str, Sequence[str]] = {}
    for kind in kinds if declared else ():
        for name, inner in getattr(declared, kind).items():
            shown[name] = [inner] if isinstance(inner, str) else inner
    return shown


class PrefixIndex:
    """Names by how they begin, found without a look at all of them."""

    def __init__(self, names: Iterable[str]):
        self._sorted = sorted(names)

    def with_prefix(self, head: str) -> Sequence[str]:
        """All names that start with `head`, sorted."""
        if not head:
            return self._sorted
        first = bisect_left(self._sorted, head)
        return self._sorted[first : bisect_left(self._sorted, head[:-1] + chr(ord(head[-1]) + 1), first)]


class SlotIndex:
    """The slots of one causality of a component, in order, found by prefix without a look at all of them."""

    def __init__(self, component: Component, causality: str):
        slots = (slot for variable in component.variables if variable.causality == causality for slot in variable.scalar_names)
        self._positions = {slot: place for place, slot in enumerate(slots)}
        self._names = PrefixIndex(self._positions)

    def below(self, prefix: str) -> dict[str, str]:
        """Slots below a prefix, by the rest of their names: "" for the prefix itself, ".position.x" below it."""
        if not prefix:
            return {f".{slot}": slot for slot in self._positions}
        found = [prefix] if prefix in self._positions else []
        found += [slot for separator in ".[" for slot in self._names.with_prefix(prefix + separator)]
        return {slot[len(prefix) :]: slot for slot in sorted(found, key=self._positions.__getitem__)}


def check_assignment(
    name: str, variables: Mapping[str, Variable], text: str, value: Any, all_elements: bool = False
) -> dict[str, Any]:
    """Values by variable name for `text` = value; a list sets an array, or the scalars text[1], text[2], ...

    `variables` are those of the component `name`, by their names. A list may be shorter than an array, whose other elements keep
    their start values, unless it has to be `whole`.

    Raises Unknown when there is no such variable, ValueError when it does not take the value.
    """
    value = value.tolist() if hasattr(value, "tolist") else value
    if text in variables:
        return {text: _check_value(variables[text], value, all_elements)}
    if f"{text}[1]" in variables:
        if not isinstance(value, list) or not value:
            raise ValueError(f'"{text}" is a list of values, found {json.dumps(value)}')
        names = [f"{text}[{i}]" for i in range(1, len(value) + 1)]
        if names[-1] not in variables:
            size = sum(other.startswith(f"{text}[") for other in variables)
            raise ValueError(f'"{text}" takes at most {size} values, found {len(value)}')
        return {each: _check_value(variables[each], element) for each, element in zip(names, value, strict=True)}
    settable = [v.name for v in variables.values() if v.causality in ("parameter", "input")]
    raise UnknownName(f'component "{name}" has no variable "{text}"{did_you_mean(text, settable)}')


def _check_value(variable: Variable, value: Any, all_elements: bool = False) -> Any:
    if variable.causality not in ("parameter", "structuralParameter", "input") and variable.start is None:
        raise ValueError(f'"{variable.name}" is of causality {variable.causality} and cannot be set')
    if variable.causality == "structuralParameter" and value != variable.start:
        raise ValueError(
            f'"{variable.name}" is a structural parameter: it stays {json.dumps(variable.start)}, found {json.dumps(value)}'
        )
    if not variable.shape:
        return _scalar_value(variable, value)
    size = len(variable.scalar_names)
    if not isinstance(value, list):
        raise ValueError(f'"{variable.name}" is an array of {size} values, expected a list, found {json.dumps(value)}')
    if len(value) > size or (all_elements and len(value) < size):
        raise ValueError(f'"{variable.name}" takes {"" if all_elements else "at most "}{size} values, found {len(value)}')
    start = variable.start if isinstance(variable.start, tuple) else (variable.start or 0,) * size
    return [*(_scalar_value(variable, element) for element in value), *start[len(value) :]]


def _enumeration_value(variable: Variable, value: Any) -> Any:
    """The value of an enumeration's item, which may be given by name."""
    items = dict(variable.items)
    if value in items:
        return items[value]
    if value in items.values() and not isinstance(value, bool):
        return value
    valid = ", ".join(f"{name} ({number})" for name, number in items.items())
    hint = did_you_mean(value, items) if isinstance(value, str) else ""
    raise ValueError(f'"{variable.name}" is one of {valid}, found {json.dumps(value)}{hint}')


def _scalar_value(variable: Variable, value: Any) -> Any:
    """The value as the variable's type. Raises ValueError when it is not of that type or out of range."""
    if variable.items:
        return _enumeration_value(variable, value)
    if not _type_accepts(variable.type, value):
        raise ValueError(f'"{variable.name}" is of type {variable.type}, found {json.dumps(value)}')
    low, high = _limits(variable)
    if (low is not None and value < low) or (high is not None and value > high):
        span = f"{'-inf' if low is None else low} ... {'inf' if high is None else high}"
        raise ValueError(f'"{variable.name}" must lie in {span}, found {json.dumps(value)}')
    return float(value) if variable.type in _REALS else value


def _limits(variable: Variable) -> tuple[float | None, float | None]:
    """What the variable allows, and at most what its type holds."""
    low, high = variable.minimum, variable.maximum
    least: float
    largest: float
    if variable.dtype.kind in "iu":
        least, largest = np.iinfo(variable.dtype).min, np.iinfo(variable.dtype).max
    elif variable.type == "Float32":
        least, largest = float(np.finfo(np.float32).min), float(np.finfo(np.float32).max)
    else:
        return low, high
    return least if low is None else max(low, least), largest if high is None else min(high, largest)


def _type_accepts(kind: str, value: Any) -> bool:
    if kind == "Boolean" or isinstance(value, bool):
        return kind == "Boolean" and isinstance(value, bool)
    if kind in ("String", "Binary"):
        return isinstance(value, str)
    return isinstance(value, int | float) and abs(value) <= sys.float_info.max if kind in _REALS else isinstance(value, int)
