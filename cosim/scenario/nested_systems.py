"""The tree of a scenario file and the nested systems that it uses."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain
from pathlib import Path
from typing import Any

from ..components.python_import import package_files
from ..core import paths, resources
from ..core.errors import InputError, Problem
from ..core.size_limits import (
    MAX_COMPONENTS,
    MAX_CONNECTIONS,
    MAX_DELAYED_VALUES,
    MAX_LEVELS,
    MAX_SCALARS,
    require_at_most,
)
from ..core.text import shorten
from .component_schema import change_paths
from .evaluation_schema import CallSpec
from .extension import expand_document, read_system_document
from .file_paths import find_scenario, relocating
from .json_document import Document, copy_json, pointer_keys, set_value
from .schema import NestedSpec, PortsSpec, ScenarioSpec, SystemSpec, ports_of
from .schema_types import accepted
from .settings import apply_settings, document_of_dict
from .validation import validate_document

_LEGAL_NAME = re.compile("[A-Za-z_][A-Za-z0-9_]*")


@dataclass
class Node:
    """System in the tree: the scenario itself (prefix ""), or a nested system (prefix "uav")."""

    document: Document
    spec: SystemSpec
    prefix: str = ""
    children: dict[str, Node] = field(default_factory=dict)
    #: components whose entries are invalid; problems that only follow from that are not reported
    invalid_components: set[str] = field(default_factory=set)
    #: keys of the file that are invalid or missing; problems that only follow from that are not
    #: reported
    invalid_keys: set[str] = field(default_factory=set)
    #: output ports that name no output; likewise
    invalid_ports: set[str] = field(default_factory=set)

    @property
    def folder(self) -> Path:
        """Folder that relative paths in the file start from."""
        return self.document.file.parent

    @property
    def ports(self) -> PortsSpec:
        """Ports of a nested system; the scenario itself has none."""
        return ports_of(self.spec)

    @property
    def has_wrong_names(self) -> bool:
        """True if names of components are illegal or occur twice.

        Then an unknown name may mean one of them.
        """
        repeated = any(
            path[:1] == ("components",) and len(path) == 2 for path in self.document.invalid_paths
        )
        return repeated or not all(map(_LEGAL_NAME.fullmatch, self.invalid_components))

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

    def where_component(self, full_name: str, *path: str | int) -> str:
        """Return the location of a part of the component with a full name such as "uav.vtol".

        "" if there is no such component.
        """
        *systems, name = full_name.split(".")
        node = self
        for system in systems:
            if system not in node.children:
                return ""
            node = node.children[system]
        exists = name in node.spec.components
        return node.where("components", name, *path) if exists else ""

    def leaves(self) -> Iterator[tuple[Node, str]]:
        """Yield (system, name) of every valid component, without nested systems, in file order."""
        for name in self.spec.components:
            if name in self.children:
                yield from self.children[name].leaves()
            elif name not in self.invalid_components:
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

    def expanded(self) -> dict[str, Any]:
        """Return the scenario as one JSON object without "extends".

        It contains the values of the caller, and absolute paths.
        """
        value: dict[str, Any] = copy_json(self.root.document.value)
        for name, setting in self.assignments.items():
            component, _, variable = name.partition(".")
            parameters = value["components"][component].setdefault("parameters", {})
            parameters.pop(variable, None)
            parameters[variable] = setting
        return change_paths(value, relocating(self.root.folder, None))

    def files(self) -> list[Path]:
        """Return all files that the scenario names, whether they exist or not."""
        return list(files_of_system(self.root, self.spec))


def files_of_system(root: Node, spec: ScenarioSpec, is_loaded: bool = False) -> set[Path]:
    """Return all files that a scenario depends on.

    These are the scenario and its nested systems, sources with their packages, input profiles,
    KPIs and figures.

    Args:
        root: The scenario.
        spec: Its specification.
        is_loaded: The components exist, so that the files from which they were built are known.
    """
    files: list[Path] = []
    for node in root.walk():
        files += node.document.files
    for _, profile in accepted(spec.inputs):
        files += profile.files(root.folder)
    calls: list[CallSpec] = [each for _, each in (*accepted(spec.kpis), *accepted(spec.figures))]
    for call in (*calls, spec.scene) if spec.scene else calls:
        files += [root.folder / path for path in call.paths]
    for node, name in root.leaves():
        source = node.spec.components[name]
        files += source.used_files(node.folder) if is_loaded else source.files(node.folder)
    python = [file for file in files if file.suffix == ".py"]
    return {*files, *package_files(python)}


def load_scenario(
    scenario: str | Path | Mapping[str, Any],
    settings: Mapping[str, Any] | None = None,
    folder: Path | None = None,
) -> Scenario:
    """Read a scenario and its nested systems.

    Args:
        scenario: A path, the name of a shipped scenario, or the content of a scenario file.
        settings: Values that the caller changes. A name that starts with "/" is a JSON pointer into
            the scenario file; any other name is that of a variable.
        folder: The folder that paths in the values of JSON pointers start from; None: the working
            directory.

    Raises:
        InputError: The file does not exist or is not JSON, or the expanded scenario is too large.
            Other problems are collected in the result.
    """
    if isinstance(scenario, Mapping):
        document = expand_document(document_of_dict(scenario))
    else:
        document = read_system_document(find_scenario(scenario))
    value = document.value if isinstance(document.value, dict) else {}
    for key, command in (
        ("factors", "sweep"),
        ("minimize", "tune"),
        ("parameters", "tune --worst"),
    ):
        if key in value and "scenario" in value and "components" not in value:
            text = f"expected a scenario, found a file for `cosim {command}`"
            raise InputError(Problem(text, document.where(("scenario",))))
    variables, problems = apply_settings(document, settings or {}, folder)
    reader = _SystemReader()
    file = reader.read(document, ScenarioSpec, ())
    check_expanded_size(file)
    problems += [*reader.problems, *_find_seed_problems(file)]
    return Scenario(_make_node(file), problems, variables)


def _find_seed_problems(file: SystemFile) -> Iterator[Problem]:
    """Yield a problem for each JSON pointer of "seeds" that no value can be set at.

    Those below invalid keys are left out.
    """
    for i, pointer in enumerate(file.spec.seeds if isinstance(file.spec, ScenarioSpec) else ()):
        text = ""
        if not pointer.startswith("/"):
            text = f'expected a JSON pointer, which begins with "/"; found "{shorten(pointer)}"'
        elif pointer.split("/")[1] not in file.invalid_keys:
            text = set_value(copy_json(file.document.value), pointer, 0)
        if text:
            yield Problem(text, file.document.where(("seeds", i)))


class _SystemReader:
    """Reader of a scenario file and the nested systems below it; every file is read once.

    `problems` collects its problems.
    """

    def __init__(self) -> None:
        #: files that have been read, by path; None if a file cannot be used
        self._files: dict[Path, SystemFile | None] = {}
        self.problems: list[Problem] = []

    def read(
        self, document: Document, kind: type[SystemSpec], ancestors: tuple[Path, ...]
    ) -> SystemFile:
        """Validate a document and read its nested systems.

        `ancestors` are the resolved files that it is nested in.
        """
        spec, problems, invalid_keys = validate_document(document, kind)
        self.problems += problems
        raw = document.value.get("components") if isinstance(document.value, dict) else None
        invalid_components = set(raw if isinstance(raw, dict) else {}) - set(spec.components)
        if not spec.components and not invalid_components and "components" not in invalid_keys:
            text = "expected at least one component, found none"
            self.problems.append(Problem(text, document.where(("components",))))
            invalid_keys.add("components")
        file = SystemFile(document, spec, invalid_keys, invalid_components, {})
        ancestors = (*ancestors, paths.resolve_path(document.file))
        for name, component in spec.components.items():
            if component.nested_system is not None:
                if child := self._read_nested(file, name, component.nested_system, ancestors):
                    file.children[name] = child
                else:
                    invalid_components.add(name)
        return file

    def _read_nested(
        self,
        parent: SystemFile,
        name: str,
        system: str | dict[str, Any],
        ancestors: tuple[Path, ...],
    ) -> SystemFile | None:
        """Return the file of a nested system, or None if it cannot be used.

        An inline system is a part of the file of its parent.
        """
        place, is_inline = ("components", name, "system"), isinstance(system, dict)
        file = parent.document.file.parent / ("" if isinstance(system, dict) else system)
        # the file's relative paths start from this folder
        key = paths.resolve_path(file.parent) / file.name
        child = None if is_inline else self._files.get(key)
        label = f'the nested system "{name if is_inline else system}"'
        try:
            if not is_inline and paths.resolve_path(file) in ancestors:
                raise InputError(f"{label} contains itself")
            if len(ancestors) + (child.levels if child else 1) > MAX_LEVELS:
                raise InputError(f"{label} is nested more than {MAX_LEVELS} levels deep")
            if is_inline:
                return self.read(parent.document.part(place), NestedSpec, ancestors)
            if key not in self._files:
                self._files[key] = None
                document = read_system_document(file)
                child = self._files[key] = self.read(document, NestedSpec, ancestors)
        except InputError as error:
            self.problems += error.located(parent.document.where(place))
            return None
        return child


def _make_node(file: SystemFile, prefix: str = "") -> Node:
    node = Node(
        file.document, file.spec, prefix, {}, set(file.invalid_components), set(file.invalid_keys)
    )
    node.children = {
        name: _make_node(child, node.full_name(name)) for name, child in file.children.items()
    }
    return node


def extending_scenario(
    base: str | Path,
    folder: Path,
    name: str,
    description: str,
    settings: Mapping[str, Any] | None = None,
    settings_folder: Path | None = None,
) -> dict[str, Any]:
    """Return the content of a scenario file that extends another one.

    Args:
        base: Path of a scenario file, or name of a shipped scenario. A shipped scenario is extended
            by its name, so that the new file runs wherever cosim is installed.
        folder: Folder of the new file.
        name: Name of the new scenario.
        description: Its description.
        settings: Changed values by names of variables or JSON pointers, as for `cosim.load`.
        settings_folder: Folder that paths in the values of JSON pointers start from; None: the
            working directory.

    Raises:
        InputError: The base does not exist, or a JSON pointer leads nowhere.
    """
    found = find_scenario(base)
    is_shipped = found.resolve().parent == (resources.root() / "scenarios").resolve()
    extended = found.stem if is_shipped else os.path.relpath(found, folder).replace(os.sep, "/")
    values: dict[str, Any] = {}
    settings = settings or {}
    if settings:
        changed = load_scenario(found, settings, settings_folder).root.document.value
        for key in settings:
            if key.startswith("/"):
                _copy_pointed(changed, values, pointer_keys(key))
    values = change_paths(values, relocating(found.parent, folder))
    for key, value in settings.items():
        if not key.startswith("/"):
            component, _, variable = key.partition(".")
            entry = values.setdefault("components", {}).setdefault(component, {})
            entry.setdefault("parameters", {})[variable] = value
    return {"extends": extended, "name": name, "description": description, **values}


def _copy_pointed(source: Any, target: dict[str, Any], keys: list[str]) -> None:
    """Copy the value that keys lead to; a list on the way is copied as a whole."""
    key, *rest = keys
    if rest and isinstance(source.get(key), dict):
        _copy_pointed(source[key], target.setdefault(key, {}), rest)
    else:
        target[key] = source[key]


#: kinds of ports through which a connection and a value of a parameter enter a nested system
CONNECTION_PORTS, VALUE_PORTS = ("inputs",), ("parameters", "inputs")


@dataclass(eq=False)
class SystemFile:
    """Scenario file or file of a nested system, read once for all its instances.

    Attributes:
        document: The file's JSON.
        spec: Its valid parts.
        invalid_keys: Keys that are invalid or missing.
        invalid_components: Components whose entries are invalid.
        children: Files of the nested systems, by component name.
    """

    document: Document
    spec: SystemSpec
    invalid_keys: set[str]
    invalid_components: set[str]
    children: dict[str, SystemFile]

    @cached_property
    def levels(self) -> int:
        """Number of nested levels, including this one."""
        return 1 + max((child.levels for child in self.children.values()), default=0)

    @cached_property
    def components(self) -> int:
        """Number of components and nested systems."""
        return len(self.spec.components) + sum(child.components for child in self.children.values())

    @cached_property
    def connections(self) -> int:
        """Number of connections and output ports.

        A connection to an input port counts once for each of its readers.
        """
        own = 0
        for _, spec in accepted(self.spec.connections):
            own += len(spec.sources) * self._count_targets(spec.target, CONNECTION_PORTS)
        profiles = self.spec.inputs if isinstance(self.spec, ScenarioSpec) else ()
        for _, profile in accepted(profiles):
            for name in chain.from_iterable(profile.to.values()):
                own += self._count_targets(name, CONNECTION_PORTS)
        return (
            own
            + len(ports_of(self.spec).outputs)
            + sum(child.connections for child in self.children.values())
        )

    @cached_property
    def delayed_values(self) -> int:
        """Number of values that all delays store, if every delayed connection is one of scalars."""
        own = sum(spec.delay * len(spec.sources) for _, spec in accepted(self.spec.connections))
        return own + sum(child.delayed_values for child in self.children.values())

    @cached_property
    def assigned_values(self) -> int:
        """Number of values that parameters and events set; a list counts with all its elements."""
        own = sum(
            self._count_targets(name, VALUE_PORTS) * (len(value) if isinstance(value, list) else 1)
            for name, value in self._assignments()
        )
        return own + sum(child.assigned_values for child in self.children.values())

    def _assignments(self) -> Iterator[tuple[str, Any]]:
        """Yield (name, value) of all parameters and events of this file."""
        for component, spec in self.spec.components.items():
            yield from (
                (f"{component}.{variable}", value) for variable, value in spec.parameters.items()
            )
        if isinstance(self.spec, ScenarioSpec):
            for _, event in accepted(self.spec.events):
                yield from event.values.items()

    def _count_targets(self, text: str, kinds: Sequence[str]) -> int:
        """Return the number of inner names that a name refers to.

        A nested system counts as its largest port.
        """
        name, _, rest = text.partition(".")
        child = self.children.get(name)
        if child is None:
            return 1
        targets = child._targets_by_port[kinds]
        port = re.split(r"[.\[]", rest, maxsplit=1)[0]
        if port:
            return targets[port] if port in targets else child._count_targets(rest, kinds)
        inner_counts = [child._count_targets(inner, kinds) for inner in child.children]
        return max([1, *targets.values(), *inner_counts])

    @cached_property
    def _targets_by_port(self) -> Mapping[Sequence[str], Mapping[str, int]]:
        """Number of inner names of every port, by kinds and port."""
        counts: dict[Sequence[str], dict[str, int]] = {}
        for kinds in (CONNECTION_PORTS, VALUE_PORTS):
            own = counts[kinds] = {}
            for kind in kinds:
                for port, names in getattr(ports_of(self.spec), kind).items():
                    own[port] = sum(self._count_targets(inner, kinds) for inner in names)
        return counts


def check_expanded_size(file: SystemFile) -> None:
    """Compare the size of the expanded scenario with its limits.

    Raises:
        InputError: The scenario exceeds a limit.
    """
    for key, limit, count, noun in (
        ("components", MAX_COMPONENTS, file.components, "components and nested systems"),
        ("connections", MAX_CONNECTIONS, file.connections, "connections and output ports"),
        ("connections", MAX_DELAYED_VALUES, file.delayed_values, "values that delays store"),
        ("components", MAX_SCALARS, file.assigned_values, "values of parameters and events"),
    ):
        require_at_most(
            limit, count, f"{noun} in the expanded scenario", file.document.where((key,))
        )
