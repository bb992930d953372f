"""Functions that a scenario names: KPIs, figures, and what the 3-D replay draws."""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..errors import did_you_mean
from ..paths import is_file
from ..python_component import load_object
from .schema import CallSpec


def function_problem(spec: CallSpec, folder: Path) -> str:
    """Why `file.py:function` or `package.module:function` cannot be called with its arguments later; "" when it can.

    The file is read, not run.
    """
    file, _, name = spec.python.rpartition(":")
    if not name.isidentifier() or not (file.endswith(".py") or all(part.isidentifier() for part in file.split("."))):
        return f'expected "file.py:function" or "package.module:function", found "{spec.python}"'
    path = folder / file if file.endswith(".py") else _module_file(file)
    if path is None or not is_file(path):
        return f'{"file" if file.endswith(".py") else "module"} "{file}" does not exist'
    try:
        functions = _functions(path.read_bytes())
    except SyntaxError as error:
        return f'"{file}" is no Python: {error.msg} (line {error.lineno})'
    if name not in functions:
        return f'"{file}" defines no function "{name}"{did_you_mean(name, functions)}'
    return _argument_problem(name, functions[name], spec.arguments)


@lru_cache(16)  # several functions of one file are the rule, and sweeps load a scenario again and again
def _functions(source: bytes) -> dict[str, ast.arguments]:
    """The functions that a file defines."""
    return {node.name: node.args for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}


def _module_file(module: str) -> Path | None:
    """Where an installed module lies; the packages around it are imported."""
    try:
        spec = find_spec(module)
    except ImportError:
        return None
    return Path(spec.origin) if spec and spec.origin else None


def load_function(reference: str, folder: Path) -> Callable[..., Any]:
    """What `file.py:function`, relative to `folder`, or `package.module:function` is; raises InputError as `load_object`."""
    module, _, name = reference.rpartition(":")
    if module.endswith(".py"):
        return load_object(reference, folder)
    return getattr(import_module(module), name)


def _argument_problem(name: str, declared: ast.arguments, given: Collection[str]) -> str:
    """What is wrong with the keyword arguments of a function whose first argument is the result (or the scenario)."""
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
