"""Definitions of the functions in Python files, which are parsed but not executed."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Mapping
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from ..core.paths import is_file
from .evaluation_schema import CallSpec


class _Source(NamedTuple):
    """Names at the top level of a source file.

    Attributes:
        functions: Definitions by name.
        imported: Module beside the file, and name in it, of each imported name.
    """

    functions: Mapping[str, ast.FunctionDef]
    imported: Mapping[str, tuple[str, str]]


def source_path(file: str, folder: Path) -> Path | None:
    """Return the source file of a Python file, whose path starts from `folder`, or of an importable module; None without one.

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
    """Return the definition of a function that exists (see `named_functions.definition_problem`)."""
    file, _, name = spec.python.rpartition(":")
    path = source_path(file, folder)
    assert path is not None
    return function_definitions(path)[name]


def function_definitions(path: Path) -> dict[str, ast.FunctionDef]:
    """Return the functions that a file defines at its top level, and those that it imports from files beside it, by name.

    Raises:
        SyntaxError: The file is not valid Python.
    """
    source, found = _parse(path.read_bytes()), {}
    for name, (module, original) in source.imported.items():
        file = path.with_name(f"{module}.py")
        if is_file(file) and (definition := _parse(file.read_bytes()).functions.get(original)):
            found[name] = definition
    return {**found, **source.functions}


@lru_cache(16)  # a file often has several functions, and sweeps load the same scenario many times
def _parse(source: bytes) -> _Source:
    body = ast.parse(source).body
    imports = [
        node
        for node in body
        if isinstance(node, ast.ImportFrom) and node.level <= 1 and node.module
    ]
    imported = {
        alias.asname or alias.name: (str(node.module), alias.name)
        for node in imports
        for alias in node.names
    }
    return _Source(
        {node.name: node for node in body if isinstance(node, ast.FunctionDef)}, imported
    )


@lru_cache(64)  # definitions are cached, so that equal ones are identical
def kpi_value_names(function: ast.FunctionDef) -> list[str]:
    """Return the names of a KPI's values without indices, or nothing if its last `return` does not write them as literals.

    Names in earlier `return` statements, such as those for runs without a landing, are included.
    """
    returned = [list(_dict_keys(value)) for value in _returned_expressions(function)]
    known = returned and "" not in returned[-1]
    return list(dict.fromkeys(key for keys in returned for key in keys if key)) if known else []


def _returned_expressions(node: ast.AST) -> Iterator[ast.expr | None]:
    """Yield the expressions of all `return` statements of a function, except those of functions inside it."""
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
