"""Walking and rewriting the trees of a flat model."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from typing import Any

from .flat_model import Assign, Builtin, Colon, Expression, Index, Literal, MultiAssign, Name, Place, base_name

#: operators on the value before the present event
MEMORY = ("pre", "edge", "change")


def walk(node: Any) -> Iterator[Any]:
    """The node and everything below it, in order of writing."""
    if isinstance(node, tuple) and not isinstance(node, Place | Colon):
        for item in node:
            yield from walk(item)
    elif is_dataclass(node):
        yield node
        for field in fields(node):
            yield from walk(getattr(node, field.name))


def rewrite(node: Any, change: Callable[[Any], Any]) -> Any:
    """The tree with `change` applied to each of its nodes, from the leaves to the root."""
    if isinstance(node, tuple) and not isinstance(node, Place | Colon):
        return tuple(rewrite(item, change) for item in node)
    if not is_dataclass(node) or isinstance(node, type):
        return node
    return change(replace(node, **{field.name: rewrite(getattr(node, field.name), change) for field in fields(node)}))


def reads(node: Any) -> Iterator[Name | Index]:
    """The references whose present value is read: not the targets of assignments, and not what stands under pre()."""
    if isinstance(node, Assign):
        yield from _subscript_reads(node.target)
        yield from reads(node.value)
    elif isinstance(node, MultiAssign):
        for target in node.targets:
            yield from _subscript_reads(target)
        yield from reads(node.call)
    elif isinstance(node, Name) or (isinstance(node, Index) and _is_constant(node)):
        yield node
    elif isinstance(node, tuple) and not isinstance(node, Place | Colon):
        for item in node:
            yield from reads(item)
    elif is_dataclass(node) and not (isinstance(node, Builtin) and node.name == "pre"):
        for field in fields(node):
            yield from reads(getattr(node, field.name))


def _subscript_reads(target: Name | Index) -> Iterator[Name | Index]:
    if isinstance(target, Index):
        yield from reads(target.subscripts)


def _is_constant(node: Index) -> bool:
    return isinstance(node.base, Name) and all(isinstance(s, Literal) for s in node.subscripts)


def names(node: Any) -> set[str]:
    """Every variable that occurs below a node."""
    return {item.name for item in walk(node) if isinstance(item, Name)}


def targets(node: Any) -> Iterator[Name | Index]:
    """What the statements below a node assign."""
    for item in walk(node):
        if isinstance(item, Assign):
            yield item.target
        elif isinstance(item, MultiAssign):
            yield from item.targets


def remembered(node: Any) -> Iterator[tuple[str, Builtin]]:
    """The variables under pre(), edge() and change(), each with the call."""
    for item in walk(node):
        if isinstance(item, Builtin) and item.name in MEMORY:
            yield base_name(item.arguments[0]), item


def has_builtin(node: Expression, *builtins: str) -> bool:
    return any(isinstance(item, Builtin) and item.name in builtins for item in walk(node))
