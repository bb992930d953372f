"""Functions that a scenario names: KPIs and figures."""

from __future__ import annotations

import ast
from collections.abc import Sequence
from pathlib import Path

from ..errors import did_you_mean
from .schema import FunctionSpec


def missing_function(spec: FunctionSpec, folder: Path) -> str:
    """Why `file.py:function` cannot be called later; "" when it can. The file is read, not run."""
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
    functions: Sequence[str] = [node.name for node in tree.body if isinstance(node, ast.FunctionDef)]
    return "" if name in functions else f'"{file}" defines no function "{name}"{did_you_mean(name, functions)}'
