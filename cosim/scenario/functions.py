"""Functions that a scenario names: KPIs and figures."""

from __future__ import annotations

import ast
from collections.abc import Collection
from pathlib import Path

from ..errors import did_you_mean
from .schema import FunctionSpec


def function_problem(spec: FunctionSpec, folder: Path) -> str:
    """Why `file.py:function` cannot be called with its arguments later; "" when it can. The file is read, not run."""
    file, _, name = spec.python.rpartition(":")
    path = folder / file
    if not file.endswith(".py") or not name.isidentifier():
        return f'expected "file.py:function", found "{spec.python}"'
    if not path.is_file():
        return f'file "{file}" does not exist'
    try:
        tree = ast.parse(path.read_bytes())
    except SyntaxError as error:
        return f'"{file}" is no Python: {error.msg} (line {error.lineno})'
    functions = {node.name: node.args for node in tree.body if isinstance(node, ast.FunctionDef)}
    if name not in functions:
        return f'"{file}" defines no function "{name}"{did_you_mean(name, functions)}'
    return _argument_problem(name, functions[name], spec.arguments)


def _argument_problem(name: str, declared: ast.arguments, given: Collection[str]) -> str:
    """What is wrong with the keyword arguments of a function whose first argument is the result."""
    positional = [argument.arg for argument in (*declared.posonlyargs, *declared.args)]
    optional = positional[len(positional) - len(declared.defaults) :]
    keywords = dict(zip((argument.arg for argument in declared.kwonlyargs), declared.kw_defaults, strict=True))
    known = [*positional[1:], *keywords]
    required = [
        *(arg for arg in positional[1:] if arg not in optional),
        *(arg for arg, default in keywords.items() if not default),
    ]
    for argument in given:
        if argument not in known and declared.kwarg is None:
            return f'"{name}" takes no argument "{argument}"{did_you_mean(argument, known)}'
    missing = [argument for argument in required if argument not in given]
    return f'"{name}" needs the argument{"s" * (len(missing) > 1)} {", ".join(missing)}' if missing else ""
