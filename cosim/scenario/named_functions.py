"""The Python functions that a scenario names: KPIs, figures and the scene of the 3-D replay."""

import ast
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from ..components.python_import import load_object
from ..core.errors import Problem, did_you_mean, nearest_file
from ..core.paths import is_file
from ..results.checks import kpi_hint
from .evaluation_schema import CallSpec, FunctionSpec
from .function_definitions import (
    argument_problem,
    function_definition,
    function_definitions,
    kpi_value_names,
    source_path,
)
from .nested_systems import Node
from .schema import ScenarioSpec
from .schema_types import accepted

#: end of the message about a signal that is not recorded
RECORDED_INPUTS = ' (inputs are recorded if "record" names them)'


def find_function_problems(
    root: Node, declared: ScenarioSpec, spec: ScenarioSpec, signals: Collection[str] | None
) -> Iterator[Problem]:
    """Yield the problems of a scenario's KPIs, figures, scene and checks.

    Args:
        root: The scenario.
        declared: Its specification.
        spec: Its specification with the values of all arguments, see `FunctionResolver`.
        signals: The names of the recorded signals, or None if they are not all known.
    """
    for kind in ("kpis", "figures"):
        functions = list(accepted(getattr(spec, kind)))
        for i, function in functions:
            if text := function_problem(function, root.folder):
                yield Problem(text, root.where(kind, i))
        names: set[str] = set()
        for i, function in functions:
            if function.name in names:
                text = f'the name "{function.name}" is used more than once'
                yield Problem(text, root.where(kind, i, "name"))
            names.add(function.name)
    if spec.scene and (text := function_problem(spec.scene, root.folder)):
        yield Problem(text, root.where("scene"))
    if signals is not None:
        yield from signal_problems(root, "kpis", signals)
    kpis = [kpi for _, kpi in accepted(declared.kpis)]
    for i, check in accepted(spec.checks) if "kpis" not in root.invalid_keys else ():
        if text := kpi_name_problem(check.kpi, kpis, root.folder):
            yield Problem(text, root.where("checks", i, "kpi"))


def function_problem(spec: CallSpec, folder: Path) -> str:
    """Return why a function cannot be called with the arguments in the scenario, or "" if it can.

    See `definition_problem`.
    """
    if text := definition_problem(spec, folder):
        return text
    name, known = spec.python.rpartition(":")[2], declared_arguments(spec, folder)
    takes_all = function_definition(spec, folder).args.kwarg
    for argument in spec.arguments:
        if argument not in known and not takes_all:
            return f'"{name}" takes no argument "{argument}"{did_you_mean(argument, known)}'
    required = [argument for argument, is_required in known.items() if is_required]
    missing = [argument for argument in required if argument not in spec.arguments]
    plural = "s" * (len(missing) > 1)
    return f'"{name}" needs the argument{plural} {", ".join(missing)}' if missing else ""


def definition_problem(spec: CallSpec, folder: Path) -> str:
    """Return why a function cannot be found, or "" if it can.

    The source file is parsed, but not executed.

    Args:
        spec: The reference `file.py:function` or `package.module:function`.
        folder: The folder that the path of the file starts from.
    """
    file, _, name = spec.python.rpartition(":")
    if not name.isidentifier() or not (
        file.endswith(".py") or all(part.isidentifier() for part in file.split("."))
    ):
        return f'expected "file.py:function" or "package.module:function", found "{spec.python}"'
    path = source_path(file, folder)
    if path is None or not is_file(path):
        kind = "file" if file.endswith(".py") else "module"
        return f'{kind} "{file}" does not exist{nearest_file(path) if path else ""}'
    try:
        functions = function_definitions(path, name)
    except SyntaxError as error:
        return f'"{file}" is not valid Python: {error.msg} (line {error.lineno})'
    if name not in functions:
        return f'"{file}" defines no function "{name}"{did_you_mean(name, functions)}'
    return ""


def declared_arguments(spec: CallSpec, folder: Path) -> dict[str, bool]:
    """Return the keyword arguments that a function declares, and whether each is required.

    The first argument, which is the result or the scenario, is left out.
    """
    declared = function_definition(spec, folder).args
    positional = [argument.arg for argument in (*declared.posonlyargs, *declared.args)]
    first_default = len(positional) - len(declared.defaults)
    arguments = {name: i < first_default for i, name in enumerate(positional) if i}
    for argument, default in zip(declared.kwonlyargs, declared.kw_defaults, strict=True):
        arguments[argument.arg] = default is None
    return arguments


def _given_parameters(spec: CallSpec, folder: Path) -> Iterator[tuple[ast.arg, Any]]:
    """Yield (parameter, value) of the arguments that a scenario gives."""
    declared = function_definition(spec, folder).args
    for parameter in (*declared.posonlyargs, *declared.args, *declared.kwonlyargs):
        if parameter.arg in spec.arguments:
            yield parameter, spec.arguments[parameter.arg]


def signal_problems(root: Node, kind: str, signals: Collection[str]) -> Iterator[Problem]:
    """Yield a problem for every argument of a KPI or figure that names no recorded signal.

    The parameters are recognized by their annotations: `Signal` is the name of a signal, `Prefix`
    that of a group of signals
    (see `cosim.results.kpi`). Optional functions, and those for which `definition_problem` finds
    a problem, are skipped.

    Args:
        root: The scenario.
        kind: "kpis" or "figures".
        signals: The names of the recorded signals.
    """
    for i, spec in accepted(getattr(root.spec, kind)):
        if not spec.optional and not definition_problem(spec, root.folder):
            for argument, text in unknown_signals(spec, root, signals):
                yield Problem(text, root.where(kind, i, "arguments", argument))


def unknown_signals(
    spec: CallSpec, root: Node, signals: Collection[str]
) -> Iterator[tuple[str, str]]:
    """Yield (parameter, message) of every argument that names no recorded signal."""
    for parameter, value in _given_parameters(spec, root.folder):
        if not isinstance(value, str):
            continue
        kinds = _annotation_names(parameter.annotation)
        if "Signal" in kinds and value not in signals:
            yield parameter.arg, f'no signal "{value}" is recorded{_reason(value, root, signals)}'
        if "Prefix" in kinds and not any(
            name.startswith((f"{value}.", f"{value}[")) for name in signals
        ):
            reason = _reason(value, root, _signal_prefixes(signals))
            yield parameter.arg, f'no signal below "{value}" is recorded{reason}'


def wrong_types(spec: CallSpec, folder: Path) -> Iterator[tuple[str, str]]:
    """Yield (parameter, message) of every argument whose value does not have the annotated type."""
    for parameter, value in _given_parameters(spec, folder):
        if text := argument_problem(parameter.annotation, value):
            yield parameter.arg, text


def _reason(value: str, root: Node, names: Collection[str]) -> str:
    """Return the most probable reason for which a signal is not recorded."""
    component = value.partition(".")[0]
    if ("components", component) in root.document.removed:
        return (
            f': the component "{component}" is removed; also remove by null what needs it, or mark '
            "it as optional"
        )
    if component not in root.spec.components:
        return (
            ": the scenario has no component "
            f'"{component}"{did_you_mean(component, root.spec.components)}'
        )
    return f"{did_you_mean(value, names)}{RECORDED_INPUTS}"


def kpi_name_problem(kpi: str, kpis: Sequence[FunctionSpec], folder: Path) -> str:
    """Return why a KPI value cannot result from `kpis`, or "" if it may.

    The names of a function's values are known only if its `return` statements write them as
    literals.
    """
    name, _, key = kpi.partition(".")
    values: dict[str, list[str]] = {}
    for spec in [each for each in kpis if each.name == name] or kpis:
        values[spec.name] = []
        if not definition_problem(spec, folder):
            values[spec.name] = kpi_value_names(function_definition(spec, folder))
    if name in values and (not values[name] or key.partition("[")[0] in values[name]):
        return ""
    known: list[str] = []
    for each, names in values.items():
        known += [f"{each}.{value}" for value in names] or [each]
    return f'no KPI "{kpi}"{kpi_hint(kpi.partition("[")[0], known)}'


def _annotation_names(annotation: ast.expr | None) -> set[str]:
    """Return the names that an annotation contains."""
    nodes = ast.walk(annotation) if annotation else ()
    return {
        node.id if isinstance(node, ast.Name) else node.attr
        for node in nodes
        if isinstance(node, ast.Name | ast.Attribute)
    }


def _signal_prefixes(signals: Collection[str]) -> list[str]:
    """Return all names that are prefixes of signals."""
    prefixes: dict[str, None] = {}
    for name in signals:
        for match in re.finditer(r"[.\[]", name):
            prefixes[name[: match.start()]] = None
    return list(prefixes)


def load_function(reference: str, folder: Path) -> Callable[..., Any]:
    """Import the function `file.py:function` or `package.module:function`.

    The path of a file starts from `folder`.

    Raises:
        InputError: The file does not exist, cannot be imported, or does not define the function.
    """
    module, _, name = reference.rpartition(":")
    function: Callable[..., Any] = (
        load_object(reference, folder)
        if module.endswith(".py")
        else getattr(import_module(module), name)
    )
    return function
