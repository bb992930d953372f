"""Traversal, rewriting and Modelica text of the syntax trees of a flat model."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeGuard

from .flat_model import SECTIONS, Model
from .syntax_tree import (
    Array,
    Assert,
    Assign,
    Binary,
    Builtin,
    Call,
    Colon,
    Comprehension,
    Expression,
    Index,
    Literal,
    MultiAssign,
    Name,
    Solve,
    SourceLocation,
    Unary,
    referenced_variable,
)


def walk(node: Any) -> Iterator[Any]:
    """Yield a node and all nodes below it in pre-order."""
    if isinstance(node, tuple) and not isinstance(node, SourceLocation | Colon):
        for item in node:
            yield from walk(item)
    elif is_dataclass(node):
        yield node
        for field in fields(node):
            yield from walk(getattr(node, field.name))


def rewrite(node: Any, change: Callable[[Any], Any]) -> Any:
    """Return the tree with `change` applied to each node in post-order.

    Args:
        node: A node, or a tuple of nodes.
        change: Returns the replacement of a node. The children of the node are already replaced.
    """
    if isinstance(node, tuple) and not isinstance(node, SourceLocation | Colon):
        return tuple(rewrite(item, change) for item in node)
    if not is_dataclass(node) or isinstance(node, type):
        return node
    return change(
        replace(
            node,
            **{field.name: rewrite(getattr(node, field.name), change) for field in fields(node)},
        )
    )


def unroll(node: Comprehension, values: Sequence[Literal]) -> Array:
    """Return an array constructor with an iterator as a list of elements."""

    def element(value: Literal) -> Any:
        return rewrite(node.value, lambda each: value if each == Name(node.index) else each)

    return Array(tuple(map(element, values)))


def rewrite_outermost(node: Any, change: Callable[[Any], Any]) -> Any:
    """Return the tree with nodes replaced from the root downwards.

    Replaced nodes are not visited again.

    Args:
        node: A node, or a tuple of nodes.
        change: Returns the replacement of a node, or None to continue with its children.
    """
    if isinstance(node, tuple) and not isinstance(node, SourceLocation | Colon):
        return tuple(rewrite_outermost(item, change) for item in node)
    if not is_dataclass(node) or isinstance(node, type):
        return node
    if (changed := change(node)) is not None:
        return changed
    return replace(
        node,
        **{
            field.name: rewrite_outermost(getattr(node, field.name), change)
            for field in fields(node)
        },
    )


def rewrite_sections(model: Model, change: Callable[[Any], Any]) -> Model:
    """Return a model with `change` applied to each node of its equations and statements."""
    sections: dict[str, Any] = {name: rewrite(getattr(model, name), change) for name in SECTIONS}
    return replace(model, **sections)


def read_references(node: Any) -> Iterator[Name | Index]:
    """Yield the references whose current value is read.

    Neither assignment targets nor arguments of pre().
    """
    if isinstance(node, Assign):
        yield from _references_in_subscripts(node.target)
        yield from read_references(node.value)
    elif isinstance(node, MultiAssign):
        for target in node.targets:
            yield from _references_in_subscripts(target)
        yield from read_references(node.call)
    elif isinstance(node, Solve):
        yield from (
            item
            for item in read_references((node.residuals, node.jacobian))
            if item not in node.unknowns
        )
    elif isinstance(node, Name) or (
        isinstance(node, Index)
        and isinstance(node.base, Name)
        and all(isinstance(s, Literal) for s in node.subscripts)
    ):
        yield node
    elif isinstance(node, tuple) and not isinstance(node, SourceLocation | Colon):
        for item in node:
            yield from read_references(item)
    elif is_dataclass(node) and not (is_call(node, "pre")):
        for field in fields(node):
            yield from read_references(getattr(node, field.name))


def _references_in_subscripts(target: Name | Index) -> Iterator[Name | Index]:
    if isinstance(target, Index):
        yield from read_references(target.subscripts)


def variable_names(node: Any) -> set[str]:
    """Return the names of all variables that occur in a tree."""
    return {item.name for item in walk(node) if isinstance(item, Name)}


def assigned_references(node: Any) -> Iterator[Name | Index]:
    """Yield the targets of all assignments in a tree."""
    for item in walk(node):
        if isinstance(item, Assign):
            yield item.target
        elif isinstance(item, MultiAssign):
            yield from item.targets
        elif isinstance(item, Solve):
            yield from item.unknowns


def composed_asserts(node: Any) -> list[Assert]:
    """Return the warnings, the `terminate` and the assertions with a composed message."""
    composed = []
    for item in walk(node):
        if isinstance(item, Assert):
            is_constant = all(isinstance(part, Literal) for part in item.message)
            if item.warning or item.terminates or not is_constant:
                composed.append(item)
    return composed


def has_terminate(node: Any) -> bool:
    """Return whether a tree contains a `terminate`."""
    return any(isinstance(item, Assert) and item.terminates for item in walk(node))


def assigned_names(node: Any) -> set[str]:
    """Return the variables that the assignments in a tree change."""
    return set(map(referenced_variable, assigned_references(node)))


def is_call(node: Any, *names: str) -> TypeGuard[Builtin]:
    """Return whether a node is a call of one of these built-in functions."""
    return isinstance(node, Builtin) and node.name in names


def has_builtin(node: Any, *builtins: str) -> bool:
    """Return whether a tree calls one of these built-in functions."""
    return any(is_call(item, *builtins) for item in walk(node))


def to_text(node: Expression | Colon) -> str:
    """Return an expression as Modelica text.

    Operands that are operations themselves are in parentheses.
    """
    if isinstance(node, Literal):
        return str(node.value).lower() if isinstance(node.value, bool) else str(node.value)
    if isinstance(node, Name):
        return node.name
    if isinstance(node, Index):
        return f"{to_text(node.base)}[{', '.join(map(to_text, node.subscripts))}]"
    if isinstance(node, Binary):
        return f"{_operand(node.left)} {node.operator} {_operand(node.right)}"
    if isinstance(node, Unary):
        return f"{node.operator}{' ' * (node.operator == 'not')}{_operand(node.operand)}"
    if isinstance(node, Builtin):
        return f"{node.name}({', '.join(map(to_text, node.arguments))})"
    if isinstance(node, Call):
        return f"{node.function}({', '.join(map(to_text, node.arguments))})"
    if isinstance(node, Array):
        return f"{{{', '.join(map(to_text, node.elements))}}}"
    return ":" if isinstance(node, Colon) else "..."


def _operand(node: Expression) -> str:
    return f"({to_text(node)})" if isinstance(node, Binary) else to_text(node)
