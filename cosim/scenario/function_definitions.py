"""Definitions of the functions in Python files, which are parsed but not executed.

The values of arguments are checked against the annotations of their parameters.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from itertools import chain
from numbers import Integral, Real
from pathlib import Path
from typing import Any, NamedTuple

from ..core.paths import is_file
from ..core.text import shorten
from .evaluation_schema import CallSpec


class _Source(NamedTuple):
    """Names at the top level of a source file.

    Attributes:
        functions: Definitions by name.
        imported: Modules beside the file: the names in them by the imported names.
    """

    functions: Mapping[str, ast.FunctionDef]
    imported: Mapping[str, Mapping[str, str]]


def source_path(file: str, folder: Path) -> Path | None:
    """Return the source file of a Python file or of an importable module; None without one.

    The path of a file starts from `folder`.

    The parent packages of a module are imported.
    """
    if file.endswith(".py"):
        return folder / file
    try:
        spec = find_spec(file)
    except ImportError:
        return None
    return Path(spec.origin) if spec and spec.origin else None


def function_definition(spec: CallSpec, folder: Path) -> ast.FunctionDef:
    """Return the definition of a function that exists.

    See `named_functions.definition_problem`.
    """
    file, _, name = spec.python.rpartition(":")
    path = source_path(file, folder)
    assert path is not None
    return function_definitions(path)[name]


def function_definitions(path: Path) -> dict[str, ast.FunctionDef]:
    """Return the functions at the top level of a file, and those from files beside it, by name.

    Raises:
        SyntaxError: The file is not valid Python.
    """
    source = _parse(path.read_bytes())
    found: dict[str, ast.FunctionDef] = {}
    for module, names in source.imported.items():
        file = path.with_name(f"{module}.py")
        functions = _parse(file.read_bytes()).functions if is_file(file) else {}
        found |= {own: functions[name] for own, name in names.items() if name in functions}
    return {**found, **source.functions}


@lru_cache(16)  # a file often has several functions, and sweeps load the same scenario many times
def _parse(source: bytes) -> _Source:
    functions: dict[str, ast.FunctionDef] = {}
    imported: dict[str, dict[str, str]] = {}
    for node in ast.parse(source).body:
        if isinstance(node, ast.FunctionDef):
            functions[node.name] = node
        elif isinstance(node, ast.ImportFrom) and node.level <= 1 and node.module:
            names = imported.setdefault(node.module, {})
            names |= {alias.asname or alias.name: alias.name for alias in node.names}
    return _Source(functions, imported)


@lru_cache(64)  # definitions are cached, so that equal ones are identical
def kpi_value_names(function: ast.FunctionDef) -> list[str]:
    """Return the names of a KPI's values without indices.

    The list is empty if the last `return` does not write them as literals.

    Names in earlier `return` statements, such as those for runs without a landing, are included.
    """
    returned = [list(_dict_keys(value)) for value in _returned_expressions(function)]
    if not returned or "" in returned[-1]:
        return []
    return list(filter(None, dict.fromkeys(chain.from_iterable(returned))))


def _returned_expressions(node: ast.AST) -> Iterator[ast.expr | None]:
    """Yield the expressions of all `return` statements, without those of inner functions."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Return):
            yield child.value
        elif not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield from _returned_expressions(child)


def _dict_keys(value: ast.expr | None) -> Iterator[str]:
    """Yield the keys of a dictionary expression.

    "time" for f"time[{i}]", and "" for a key that is not a literal.
    """
    match value:
        case ast.Dict(keys, values):
            for key, each in zip(keys, values, strict=True):
                yield from [_literal_key(key)] if key else _dict_keys(each)
        case ast.DictComp(key):
            yield _literal_key(key)
        case _:
            yield ""


def _literal_key(key: ast.expr) -> str:
    """Return the literal beginning of a key without its index, or "" if there is none."""
    match key:
        case ast.Constant(str(text)):
            return text.partition("[")[0]
        case ast.JoinedStr([ast.Constant(str(text)), *_]) if "[" in text:
            return text.partition("[")[0]
    return ""


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
    if name in _LISTS:
        return "a list"
    return "an object" if name in _OBJECTS else _DESCRIPTIONS.get(name, name)


def _name(annotation: ast.expr) -> str:
    """Return the last part of the name of a type; "" for other expressions."""
    match annotation:
        case ast.Name(name) | ast.Attribute(attr=name):
            return name
        case ast.Constant(None):
            return "None"
    return ""
