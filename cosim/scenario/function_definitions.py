"""Definitions of the functions in Python files, which are parsed but not executed.

The values of arguments are checked against the annotations of their parameters.
"""

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
    return function_definitions(path, name)[name]


def function_definitions(path: Path, wanted: str = "") -> Mapping[str, ast.FunctionDef]:
    """Return the functions at the top level of a file by name.

    If `wanted` is none of them, those that it imports from files beside it are included.

    Raises:
        SyntaxError: The file is not valid Python.
    """
    source = _parse(path.read_bytes())
    if wanted in source.functions:
        return source.functions
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


#: by the name in an annotation: the type of the values, a type that is none of them although it is
#: derived from it, and the description in messages
_KINDS: dict[str, tuple[Any, Any, str]] = {
    "float": (Real, bool, "a number"),
    "int": (Integral, bool, "an integer"),
    "bool": (bool, (), "true or false"),
    "str": (str, (), "a text"),
    "Signal": (str, (), "the name of a signal"),
    "Prefix": (str, (), "a prefix of names of signals"),
    "None": (type(None), (), "null"),
    **dict.fromkeys(("dict", "Dict", "Mapping"), (Mapping, (), "an object")),
}
_LISTS = ("list", "List", "Sequence", "tuple", "Tuple", "Iterable", "Collection")
_KINDS |= dict.fromkeys(_LISTS, (Sequence, str, "a list"))


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


def _members(annotation: ast.expr) -> list[ast.expr]:
    """Return the types of a union; those of other annotations are themselves."""
    match annotation:
        case ast.BinOp(left, ast.BitOr(), right):
            return [*_members(left), *_members(right)]
        case ast.Subscript(kind, ast.Tuple(kinds)) if _name(kind) == "Union":
            return list(chain.from_iterable(map(_members, kinds)))
        case ast.Subscript(kind, inner) if _name(kind) == "Optional":
            return [*_members(inner), ast.Constant(None)]
    return [annotation]


def _accepts(annotation: ast.expr, value: Any) -> bool:
    return any(_member_accepts(member, value) for member in _members(annotation))


def _member_accepts(member: ast.expr, value: Any) -> bool:
    kind, inner = (
        (member.value, member.slice) if isinstance(member, ast.Subscript) else (member, None)
    )
    accepted, refused, _ = _KINDS.get(_name(kind), (object, (), ""))
    if not isinstance(value, accepted) or isinstance(value, refused):
        return False
    elements = _elements(inner, value) if inner and _name(kind) in _LISTS else []
    return all(_accepts(each, item) for each, item in elements)


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


def _describe(annotation: ast.expr) -> str:
    """Return what an annotation accepts: "a number or null"."""
    texts: list[str] = []
    for member in _members(annotation):
        kind = member.value if isinstance(member, ast.Subscript) else member
        name = _name(kind)
        text = _KINDS[name][2] if name in _KINDS else name
        if isinstance(member, ast.Subscript) and name in _LISTS:
            inner = member.slice
            first = inner.elts[0] if isinstance(inner, ast.Tuple) else inner
            text += f", each element {_describe(first)}"
        texts.append(text)
    return " or ".join(texts)


def _name(annotation: ast.expr) -> str:
    """Return the last part of the name of a type; "" for other expressions."""
    match annotation:
        case ast.Name(name) | ast.Attribute(attr=name):
            return name
        case ast.Constant(None):
            return "None"
    return ""
