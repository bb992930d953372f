"""The tree of a scenario file and the nested systems that it uses."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..components.python_import import package_files
from ..core import paths, resources
from ..core.errors import InputError, Problem, did_you_mean
from .json_document import Document, read_document
from .schema import CallSpec, NestedSpec, PortsSpec, ScenarioSpec, SystemSpec
from .schema_types import accepted
from .validation import validate_document


@dataclass
class Node:
    """System in the tree: the scenario itself (prefix ""), or a nested system (prefix "uav")."""

    document: Document
    spec: SystemSpec
    prefix: str = ""
    children: dict[str, Node] = field(default_factory=dict)
    #: components whose entries are invalid; problems that only follow from that are not reported
    invalid_components: set[str] = field(default_factory=set)
    #: keys of the file that are invalid or missing; problems that only follow from that are not reported
    invalid_keys: set[str] = field(default_factory=set)

    @property
    def folder(self) -> Path:
        """Folder that relative paths in the file start from."""
        return self.document.file.parent

    @property
    def ports(self) -> PortsSpec:
        """Ports of a nested system; the scenario itself has none."""
        return self.spec.ports if isinstance(self.spec, NestedSpec) else PortsSpec()

    def full_name(self, component: str) -> str:
        """Return the name of a component from the scenario's point of view, such as "uav.vtol"."""
        return f"{self.prefix}.{component}" if self.prefix else component

    def where(self, *path: str | int) -> str:
        """Return the file, line and JSON path of a part of the system, for messages."""
        return self.document.where(path)

    def walk(self) -> Iterator[Node]:
        """Yield all systems of the tree, nested ones before those that contain them."""
        for child in self.children.values():
            yield from child.walk()
        yield self

    def leaves(self) -> Iterator[tuple[Node, str]]:
        """Yield (system, name) of every valid component that is not a nested system, in the order of the files."""
        for name, component in self.spec.components.items():
            if name in self.children:
                yield from self.children[name].leaves()
            elif name not in self.invalid_components and component.system is None:
                yield self, name


@dataclass
class Scenario:
    """Scenario as read from its files, with the problems found so far."""

    root: Node
    problems: list[Problem]
    #: values of variables that the caller sets, by name
    assignments: Mapping[str, Any]

    @property
    def spec(self) -> ScenarioSpec:
        """Specification of the scenario file."""
        assert isinstance(self.root.spec, ScenarioSpec)
        return self.root.spec

    def files(self) -> list[Path]:
        """Return all files that the scenario names, whether they exist or not.

        These are the scenario and its nested systems, sources with their packages, input profiles, KPIs and figures.
        """
        files = [node.document.file for node in self.root.walk()]
        files += [self.root.folder / spec.file for _, spec in accepted(self.spec.inputs)]
        functions: list[CallSpec] = [spec for _, spec in (*accepted(self.spec.kpis), *accepted(self.spec.figures))]
        functions += [self.spec.scene] if self.spec.scene else []
        python = [self.root.folder / spec.python.rpartition(":")[0] for spec in functions if ".py:" in spec.python]
        for node, name in self.root.leaves():
            spec = node.spec.components[name]
            if spec.python:
                python.append(node.folder / spec.python.rpartition(":")[0])
            else:
                files.append(node.folder / (spec.fmu or (spec.modelica or "").rpartition(":")[0]))
        return [*files, *(member for file in python for member in package_files(file))]


def find_scenario(scenario: str | Path) -> Path:
    """Return the path of a scenario file that is given by its path or by the name of a shipped scenario.

    Raises:
        InputError: There is neither such a file nor a shipped scenario of this name.
    """
    path = Path(scenario)
    shipped = resources.root() / "scenarios"
    if path.suffix == ".json" or paths.is_file(path):
        return path
    names = sorted(file.stem for file in shipped.glob("*.json"))
    if str(scenario) not in names:
        raise InputError(f'no scenario file and no shipped scenario "{scenario}"{did_you_mean(str(scenario), names)}')
    return shipped / f"{scenario}.json"


def load_scenario(scenario: str | Path, settings: Mapping[str, Any] | None = None) -> Scenario:
    """Read a scenario and its nested systems.

    Args:
        scenario: A path, or the name of a shipped scenario.
        settings: Values that the caller changes. A name that starts with "/" is a JSON pointer into the scenario file; any
            other name is that of a variable.

    Raises:
        InputError: The file does not exist or is not JSON. Other problems are collected in the result.
    """
    document = read_document(find_scenario(scenario))
    problems: list[Problem] = []
    variables: dict[str, Any] = {}
    for name, value in (settings or {}).items():
        if name.startswith("/"):
            problems += _set_pointer(document, name, value)
        else:
            variables[name] = value
    spec, schema_problems, invalid_keys = validate_document(document, ScenarioSpec)
    root = Node(document, spec, invalid_keys=invalid_keys)
    problems += schema_problems + _load_children(root, (document.file.resolve(),))
    return Scenario(root, problems, variables)


def _load_children(node: Node, ancestors: tuple[Path, ...]) -> list[Problem]:
    """Read the nested systems of a system; `ancestors` are the resolved files it is nested in."""
    problems: list[Problem] = []
    if not node.spec.components and "components" not in node.invalid_keys:
        problems.append(Problem("expected at least one component, found none", node.where("components")))
        node.invalid_keys.add("components")
    raw = node.document.value.get("components") if isinstance(node.document.value, dict) else None
    node.invalid_components |= set(raw if isinstance(raw, dict) else {}) - set(node.spec.components)
    for name, component in node.spec.components.items():
        if component.system is None:
            continue
        try:
            file = node.folder / component.system
            if file.resolve() in ancestors:
                raise InputError(f'the nested system "{component.system}" contains itself')
            document = read_document(file)
        except InputError as error:
            node.invalid_components.add(name)
            problems += [Problem(p.message, p.where or node.where("components", name, "system")) for p in error.problems]
            continue
        spec, schema_problems, invalid_keys = validate_document(document, NestedSpec)
        node.children[name] = Node(document, spec, node.full_name(name), invalid_keys=invalid_keys)
        problems += schema_problems + _load_children(node.children[name], (*ancestors, file.resolve()))
    return problems


def pointer_keys(pointer: str) -> list[str]:
    """Return the keys and indices of a JSON pointer (RFC 6901).

    >>> pointer_keys("/components/uav/and~1or")
    ['components', 'uav', 'and/or']
    """
    return [key.replace("~1", "/").replace("~0", "~") for key in pointer[1:].split("/")]


def _set_pointer(document: Document, pointer: str, value: Any) -> list[Problem]:
    """Set a value in the JSON document; only the last key of the pointer may be new."""
    keys = pointer_keys(pointer)
    target, where = document.value, f'setting "{pointer}"'
    for depth, key in enumerate(keys[:-1]):
        target = _json_child(target, key)
        if target is None:
            return [Problem(f'the scenario has no "/{"/".join(keys[: depth + 1])}"', where)]
    if isinstance(target, dict):
        target[keys[-1]] = value
    elif isinstance(target, list) and keys[-1].isdigit() and int(keys[-1]) < len(target):
        target[int(keys[-1])] = value
    else:
        return [Problem(f'the scenario has no "{pointer}"', where)]
    return []


def _json_child(value: Any, key: str) -> Any:
    if isinstance(value, dict):
        return value.get(key)
    if isinstance(value, list) and key.isdigit() and int(key) < len(value):
        return value[int(key)]
    return None


def parse_settings(settings: Sequence[str]) -> dict[str, Any]:
    """Return the values of `NAME=value` texts by name. A value that is not JSON is taken as text.

    Raises:
        InputError: A text has no name or no "=", or a number is not finite.
    """
    parsed: dict[str, Any] = {}
    problems = []
    for text in settings:
        name, separator, value = text.partition("=")
        if not separator or not name:
            problems.append(Problem(f'expected NAME=value, found "{text}"'))
            continue
        try:
            parsed[name] = json.loads(value)
        except RecursionError:
            problems.append(Problem("nested too deeply", name))
            continue
        except ValueError:
            parsed[name] = value
        if not _is_finite(parsed[name]):
            problems.append(Problem(f"expected finite numbers, found {value}", name))
    if problems:
        raise InputError(problems)
    return parsed


def _is_finite(value: Any) -> bool:
    """Return True if all numbers in a JSON value are finite."""
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)
