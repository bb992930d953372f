"""Check of the values of arguments against the annotations of a function, which is parsed but not executed."""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping, Sequence
from numbers import Integral, Real
from typing import Any

from ..core.text import shorten

#: what a value must be, by the name in an annotation
_DESCRIPTIONS = {
    "float": "a number",
    "int": "an integer",
    "bool": "true or false",
    "str": "a text",
    "Signal": "the name of a signal",
    "Prefix": "a prefix of names of signals",
    "None": "null",
}
_LISTS = ("list", "List", "Sequence", "tuple", "Tuple", "Iterable", "Collection")
_OBJECTS = ("dict", "Dict", "Mapping")


def argument_problem(annotation: ast.expr | None, value: Any) -> str:
    """Return why a value does not have the type that an annotation declares, or "" if it does.

    Annotations with other types than numbers, texts, Booleans, lists, objects and unions of these
    accept every value.

    >>> argument_problem(ast.parse("float | None", mode="eval").body, "300")
    'expected a number or null; found "300"'
    >>> argument_problem(ast.parse("Sequence[float]", mode="eval").body, [1, 2.5])
    ''
    """
    if annotation is None or _accepts(annotation, value):
        return ""
    return (
        f"expected {_describe(annotation)}; found "
        f"{shorten(json.dumps(value, ensure_ascii=False, default=repr))}"
    )


def _accepts(annotation: ast.expr, value: Any) -> bool:
    match annotation:
        case ast.BinOp(left, ast.BitOr(), right):
            return _accepts(left, value) or _accepts(right, value)
        case ast.Subscript(kind, ast.Tuple(kinds)) if _name(kind) == "Union":
            return any(_accepts(each, value) for each in kinds)
        case ast.Subscript(kind, inner) if _name(kind) == "Optional":
            return value is None or _accepts(inner, value)
        case ast.Subscript(kind, inner) if _name(kind) in _LISTS:
            return _accepts_name("list", value) and all(
                _accepts(each, item) for each, item in _elements(inner, value)
            )
        case ast.Subscript(kind):
            return _accepts_name(_name(kind), value)
    return _accepts_name(_name(annotation), value)


def _elements(inner: ast.expr, value: Sequence[Any]) -> list[tuple[ast.expr, Any]]:
    """Return (annotation, element) of every element of a list.

    The elements of a fixed tuple are not compared.
    """
    match inner:
        case ast.Tuple([kind, ast.Constant(value=ellipsis)]) if ellipsis is ...:
            return [(kind, item) for item in value]
        case ast.Tuple():
            return []
    return [(inner, item) for item in value]


def _accepts_name(name: str, value: Any) -> bool:
    match name:
        case "float":
            return isinstance(value, Real) and not isinstance(value, bool)
        case "int":
            return isinstance(value, Integral) and not isinstance(value, bool)
        case "bool":
            return isinstance(value, bool)
        case "str" | "Signal" | "Prefix":
            return isinstance(value, str)
        case "None":
            return value is None
    if name in _LISTS:
        return isinstance(value, Sequence) and not isinstance(value, str)
    return name not in _OBJECTS or isinstance(value, Mapping)


def _describe(annotation: ast.expr) -> str:
    """Return what an annotation accepts: "a number or null"."""
    match annotation:
        case ast.BinOp(left, ast.BitOr(), right):
            return f"{_describe(left)} or {_describe(right)}"
        case ast.Subscript(kind, ast.Tuple(kinds)) if _name(kind) == "Union":
            return " or ".join(map(_describe, kinds))
        case ast.Subscript(kind, inner) if _name(kind) == "Optional":
            return f"{_describe(inner)} or null"
        case ast.Subscript(kind, inner) if _name(kind) in _LISTS:
            first = inner.elts[0] if isinstance(inner, ast.Tuple) else inner
            return f"a list, each element {_describe(first)}"
        case ast.Subscript(kind):
            return _describe(kind)
    name = _name(annotation)
    return (
        "a list"
        if name in _LISTS
        else "an object"
        if name in _OBJECTS
        else _DESCRIPTIONS.get(name, name)
    )


def _name(annotation: ast.expr) -> str:
    """Return the last part of the name of a type; "" for other expressions."""
    match annotation:
        case ast.Name(name) | ast.Attribute(attr=name):
            return name
        case ast.Constant(None):
            return "None"
    return ""
