"""A scenario file and the nested systems it uses, as a tree."""

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
from .schema import CallSpec, NestedSpec, ScenarioSpec, SystemSpec, accepted
from .validation import validate_document


@dataclass
class Node:
    """One system: the scenario itself (prefix ""), or a nested system (prefix "uav").

    `broken` holds the names of components whose description was refused; nothing more is said about them.
    """

    document: Document
    spec: SystemSpec
    prefix: str = ""
    children: dict[str, Node] = field(default_factory=dict)
    invalid_components: set[str] = field(default_factory=set)
    #: keys of the file that were refused or are missing: nothing that follows from them is said
    invalid_keys: set[str] = field(default_factory=set)

    @property
    def folder(self) -> Path:
        """Where relative paths start."""
        return self.document.file.parent

    def full_name(self, component: str) -> str:
        return f"{self.prefix}.{component}" if self.prefix else component

    def where(self, *path: str | int) -> str:
        return self.document.where(path)

    def walk(self) -> Iterator[Node]:
        """Nested systems first, then this one."""
        for child in self.children.values():
            yield from child.walk()
        yield self

    def leaves(self) -> Iterator[tuple[Node, str]]:
        """(system, name) of every component that is no nested system, in the order of the files; refused ones left out."""
        for name, component in self.spec.components.items():
            if name in self.children:
                yield from self.children[name].leaves()
            elif name not in self.invalid_components and component.system is None:
                yield self, name


@dataclass
class Scenario:
    """A scenario with everything that is wrong with it so far, and the variables set from outside."""

    root: Node
    problems: list[Problem]
    assignments: Mapping[str, Any]

    @property
    def spec(self) -> ScenarioSpec:
        assert isinstance(self.root.spec, ScenarioSpec)
        return self.root.spec

    def files(self) -> list[Path]:
        """All files that are named, there or not: nested systems, sources with their packages, profiles, KPIs and figures."""
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
    """A path as it is, or the file of a shipped scenario given by its name."""
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

    `settings` are changes from outside: names that start with "/" are JSON pointers into the scenario file, "stop_time" and
    "step_size" its times, all others variables. Raises InputError when there is no file, or no JSON in it.
    """
    document = read_document(find_scenario(scenario))
    problems: list[Problem] = []
    variables: dict[str, Any] = {}
    for name, value in (settings or {}).items():
        if name.startswith("/"):
            problems += _set_pointer(document, name, value)
        else:
            variables[name] = value
    spec, found, refused = validate_document(document, ScenarioSpec)
    root = Node(document, spec, invalid_keys=refused)
    problems += found + _load_children(root, (document.file.resolve(),))
    return Scenario(root, problems, variables)


def _load_children(node: Node, ancestors: tuple[Path, ...]) -> list[Problem]:
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
        spec, found, refused = validate_document(document, NestedSpec)
        node.children[name] = Node(document, spec, node.full_name(name), invalid_keys=refused)
        problems += found + _load_children(node.children[name], (*ancestors, file.resolve()))
    return problems


def pointer_keys(pointer: str) -> list[str]:
    """The steps of a JSON pointer.

    >>> pointer_keys("/components/uav/and~1or")
    ['components', 'uav', 'and/or']
    """
    return [key.replace("~1", "/").replace("~0", "~") for key in pointer[1:].split("/")]


def _set_pointer(document: Document, pointer: str, value: Any) -> list[Problem]:
    """Change the JSON value before it is read; the last step may be new."""
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
    """The values of `NAME=value` texts: JSON where it is JSON, else text.

    Raises InputError for texts without "=" and for numbers that are not finite.
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
        except ValueError:
            parsed[name] = value
        if not _is_finite(parsed[name]):
            problems.append(Problem(f"expected finite numbers, found {value}", name))
    if problems:
        raise InputError(problems)
    return parsed


def _is_finite(value: Any) -> bool:
    """Whether all numbers in a JSON value are finite."""
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)
