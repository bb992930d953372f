"""Functions that a scenario names: KPIs, figures, and what the 3-D replay draws."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..components.python_import import load_object
from ..core.errors import Problem, did_you_mean
from ..core.paths import is_file
from .nested_systems import Node
from .schema import CallSpec, FunctionSpec, accepted


def function_problem(spec: CallSpec, folder: Path) -> str:
    """Why `file.py:function` or `package.module:function` cannot be called with its arguments later; "" when it can.

    The file is read, not run.
    """
    file, _, name = spec.python.rpartition(":")
    if not name.isidentifier() or not (file.endswith(".py") or all(part.isidentifier() for part in file.split("."))):
        return f'expected "file.py:function" or "package.module:function", found "{spec.python}"'
    path = _source_path(file, folder)
    if path is None or not is_file(path):
        return f'{"file" if file.endswith(".py") else "module"} "{file}" does not exist'
    try:
        functions = _function_definitions(path.read_bytes())
    except SyntaxError as error:
        return f'"{file}" is no Python: {error.msg} (line {error.lineno})'
    if name not in functions:
        return f'"{file}" defines no function "{name}"{did_you_mean(name, functions)}'
    return _argument_problem(name, functions[name].args, spec.arguments)


def signal_problems(root: Node, kind: str, signals: Collection[str]) -> Iterator[Problem]:
    """What is wrong with arguments of a scenario's sound "kpis" or "figures" that have to name something of `signals`.

    Annotations say so: `Signal` is one of them, `Prefix` something that has signals below it (see `cosim.results.kpi`).
    """
    for i, spec in accepted(getattr(root.spec, kind)):
        if not function_problem(spec, root.folder):
            for argument, text in _unknown_signals(spec, root.folder, signals):
                yield Problem(text, root.where(kind, i, "arguments", argument))


def _unknown_signals(spec: CallSpec, folder: Path, signals: Collection[str]) -> Iterator[tuple[str, str]]:
    declared = _function_definition(spec, folder).args
    for parameter in (*declared.posonlyargs, *declared.args, *declared.kwonlyargs):
        value, kinds = spec.arguments.get(parameter.arg), _annotation_names(parameter.annotation)
        if not isinstance(value, str):
            continue
        if "Signal" in kinds and value not in signals:
            yield parameter.arg, f'no signal "{value}" is recorded{did_you_mean(value, signals)}'
        if "Prefix" in kinds and not any(name.startswith((f"{value}.", f"{value}[")) for name in signals):
            yield parameter.arg, f'no signal below "{value}" is recorded{did_you_mean(value, _signal_prefixes(signals))}'


def kpi_name_problem(kpi: str, kpis: Sequence[FunctionSpec], folder: Path) -> str:
    """Why there will be no number "landing.lateral_error" among those of `kpis`; "" when there is one or may be one."""
    name, _, key = kpi.partition(".")
    spec = next((spec for spec in kpis if spec.name == name), None)
    if spec is None:
        return f'no KPI "{kpi}"{did_you_mean(name, [spec.name for spec in kpis])}'
    keys = [] if function_problem(spec, folder) else _kpi_value_names(_function_definition(spec, folder))
    if not keys or key.partition("[")[0] in keys:
        return ""
    return f'no KPI "{kpi}"{did_you_mean(kpi, [f"{name}.{known}" for known in keys])}'


def _source_path(file: str, folder: Path) -> Path | None:
    return folder / file if file.endswith(".py") else _module_file(file)


def _function_definition(spec: CallSpec, folder: Path) -> ast.FunctionDef:
    """The definition of a function that has no problem."""
    file, _, name = spec.python.rpartition(":")
    path = _source_path(file, folder)
    assert path is not None
    return _function_definitions(path.read_bytes())[name]


@lru_cache(16)  # several functions of one file are the rule, and sweeps load a scenario again and again
def _function_definitions(source: bytes) -> dict[str, ast.FunctionDef]:
    """The functions that a file defines."""
    return {node.name: node for node in ast.parse(source).body if isinstance(node, ast.FunctionDef)}


def _annotation_names(annotation: ast.expr | None) -> set[str]:
    """The names in an annotation."""
    nodes = ast.walk(annotation) if annotation else ()
    return {node.id if isinstance(node, ast.Name) else node.attr for node in nodes if isinstance(node, ast.Name | ast.Attribute)}


def _signal_prefixes(signals: Collection[str]) -> list[str]:
    """Everything that has signals below it."""
    return list(dict.fromkeys(name[: place.start()] for name in signals for place in re.finditer(r"[.\[]", name)))


def _kpi_value_names(function: ast.FunctionDef) -> list[str]:
    """What a KPI calls its numbers, without indices, when its last `return` writes them down; else nothing.

    Returns before the last one, for runs in which something did not happen, may add to them.
    """
    returned = [list(_dict_keys(value)) for value in _returned_expressions(function)]
    known = returned and "" not in returned[-1]
    return list(dict.fromkeys(key for keys in returned for key in keys if key)) if known else []


def _returned_expressions(node: ast.AST) -> Iterator[ast.expr | None]:
    """What the code returns, functions inside it left out."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Return):
            yield child.value
        elif not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield from _returned_expressions(child)


def _dict_keys(value: ast.expr | None) -> Iterator[str]:
    """The keys of a dictionary as it is written, "time" for f"time[{i}]"; "" stands for those that are not written down."""
    match value:
        case ast.Dict(keys, values):
            for key, each in zip(keys, values, strict=True):
                yield from [_literal_key(key)] if key else _dict_keys(each)
        case ast.DictComp(key):
            yield _literal_key(key)
        case _:
            yield ""


def _literal_key(key: ast.expr) -> str:
    match key:
        case ast.Constant(str(text)):
            return text.partition("[")[0]
        case ast.JoinedStr([ast.Constant(str(text)), *_]) if "[" in text:
            return text.partition("[")[0]
    return ""


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
