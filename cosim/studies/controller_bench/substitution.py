"""Scenarios in which a candidate replaces the shipped controller.

Entries of a scenario that refer to variables which the candidate lacks (parameters, connections to inputs, KPIs of its signals)
are removed and noted. References are removed, since another controller gives other trajectories.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...core.errors import InputError
from ...results.files import write_json
from ...scenario.component_schema import SOURCES
from ...scenario.evaluation_schema import FunctionSpec
from ...scenario.extension import read_system_document
from ...scenario.named_functions import declared_arguments
from ...scenario.nested_systems import load_scenario
from .candidate import CandidateInterface, CandidateSource
from .role import Role

#: returns whether a name of a system still exists
NameFilter = Callable[[str], bool]
#: end of the first part of a name
_SEPARATOR = re.compile(r"[.\[]")


@dataclass(frozen=True)
class Omission:
    """Entry of a scenario that is left out because the candidate lacks a variable.

    Attributes:
        entry: 'kpi "descent"' or 'figure "landing"'; "" for a value of the variable or a connection to it.
        variable: full name of the variable.
    """

    entry: str
    variable: str

    def __str__(self) -> str:
        if self.entry:
            return f'{self.entry} is left out: the candidate has no "{self.variable}"'
        return f'"{self.variable}" is left out: the candidate has no such variable'


@dataclass
class ControllerSubstitution:
    """Substitution of the candidate for the controllers of a role in one scenario.

    Attributes:
        role: the role.
        candidate: the candidate's source.
        interface: the candidate's variables.
        file: the scenario's file.
        parameters: parameters of the candidate in addition to those of the scenario.
        replaced_components: names of the replaced controllers, such as "ar_drone_cascaded", by the full names of the components.
        omissions: removed entries.
    """

    role: Role
    candidate: CandidateSource
    interface: CandidateInterface
    file: Path
    parameters: Mapping[str, Any] = field(default_factory=dict)
    replaced_components: dict[str, str] = field(default_factory=dict)
    omissions: list[Omission] = field(default_factory=list)
    _folder: Path = field(init=False)

    def write(self, folder: Path) -> Path | None:
        """Write the changed scenario and its nested systems to `folder` and return its path.

        Returns:
            None if no component has the role, or if the file is not a scenario (has no components).

        Raises:
            InputError: if the scenario is invalid.
        """
        loaded = load_scenario(self.file)
        if "components" not in loaded.root.document.value:
            return None
        if loaded.problems:
            raise InputError(loaded.problems)
        self._folder, origin = folder, self.file.parent.resolve()
        changed, known = self._substitute_system(loaded.root.document.value, origin, "")
        if not self.replaced_components:
            return None
        path = folder / self.file.name
        write_json(self._prune_scenario(changed, known, origin), path)
        return path

    # -- systems -------------------------------------------------------------------------------------------------------

    def _substitute_system(self, value: Mapping[str, Any], folder: Path, prefix: str) -> tuple[dict[str, Any], NameFilter]:
        """Return a system that contains the candidate, and a filter of the names that exist in it."""
        filters: dict[str, NameFilter] = {}
        components = {
            name: self._substitute_component(spec, folder, f"{prefix}{name}", name, filters)
            for name, spec in value["components"].items()
        }

        def known(name: str) -> bool:
            component, _, rest = name.partition(".")
            return component not in filters or filters[component](rest)

        for name in filters:
            spec = components[name]
            parameters = {key: v for key, v in spec.get("parameters", {}).items() if self._is_kept(known, f"{name}.{key}")}
            components[name] = {**spec, "parameters": parameters}
        connections = [each for each in value.get("connections", []) if self._is_kept(known, each["to"])]
        return {**value, "components": components, "connections": connections}, known

    def _substitute_component(
        self, spec: Mapping[str, Any], folder: Path, full_name: str, name: str, filters: dict[str, NameFilter]
    ) -> dict[str, Any]:
        kind = next(source for source in SOURCES if source in spec)
        path = (folder / _reference_file(spec[kind])).resolve()
        if path in self.role.controllers:
            self.replaced_components[full_name] = path.stem
            filters[name] = self.interface.has_variables
            period = {key: value for key, value in spec.items() if key == "period"}
            return {**self.candidate.entry, **period, "parameters": {**spec.get("parameters", {}), **self.parameters}}
        system = self.role.stand_ins.get(path, path if kind == "system" else None)
        nested = self._substitute_nested(system, full_name) if system else None
        if nested is None:
            return {**spec, kind: absolute_reference(spec[kind], folder)}
        changed, filters[name] = nested
        return {key: value for key, value in spec.items() if key not in (kind, "isolation")} | {"system": str(changed)}

    def _substitute_nested(self, file: Path, full_name: str) -> tuple[Path, NameFilter] | None:
        """Write a nested system with the candidate; return its path and name filter, or None if no component has the role."""
        before = len(self.replaced_components)
        value, known = self._substitute_system(read_system_document(file).value, file.parent, f"{full_name}.")
        if len(self.replaced_components) == before:
            return None
        ports, lost = self._prune_ports(value.get("ports", {}), known)
        path = self._folder / "systems" / f"{self.file.stem}.{full_name}.json"
        write_json({**value, "ports": ports}, path)
        shown = {port for kind in ports.values() for port in kind}

        def known_outside(name: str) -> bool:
            port = _SEPARATOR.split(name, 1)[0]
            return port in shown or (port not in lost and known(name))

        return path, known_outside

    def _prune_ports(self, ports: Mapping[str, Any], known: NameFilter) -> tuple[dict[str, Any], set[str]]:
        """Return the ports that lead to a `known` variable of the changed system, and the names of the removed ports."""
        remaining: dict[str, dict[str, Any]] = {kind: {} for kind in ports}
        lost = set()
        for kind, named in ports.items():
            for port, inner in named.items():
                targets = [name for name in ([inner] if isinstance(inner, str) else inner) if known(name)]
                if targets:
                    remaining[kind][port] = targets[0] if isinstance(inner, str) else targets
                else:
                    lost.add(port)
        return remaining, lost

    # -- the scenario's own keys ---------------------------------------------------------------------------------------

    def _prune_scenario(self, value: dict[str, Any], known: NameFilter, folder: Path) -> dict[str, Any]:
        signals = [name for name in value.get("record", {}).get("signals", ["*"]) if "*" in name or known(name)]
        functions = {
            key: [
                {**each, "python": absolute_reference(each["python"], folder)}
                for each in value.get(key, [])
                if self._all_known(known, each, folder, f'{key[:-1]} "{each["name"]}"')
            ]
            for key in ("kpis", "figures")
        }
        kpis = {each["name"] for each in functions["kpis"]}
        events = [{**each, "set": self._known_settings(known, each["set"])} for each in value.get("events", [])]
        inputs = [{**each, "file": absolute_reference(each["file"], folder)} for each in value.get("inputs", [])]
        scene = value.get("scene")
        return {
            **{key: item for key, item in value.items() if key != "reference"},
            **functions,
            "record": {**value.get("record", {}), "signals": signals},
            "checks": [each for each in value.get("checks", []) if each["kpi"].partition(".")[0] in kpis],
            "events": [each for each in events if each["set"]],
            "inputs": inputs,
            **({"scene": {**scene, "python": absolute_reference(scene["python"], folder)}} if scene else {}),
        }

    def _known_settings(self, known: NameFilter, settings: Mapping[str, Any]) -> dict[str, Any]:
        return {name: value for name, value in settings.items() if self._is_kept(known, name)}

    def _all_known(self, known: NameFilter, function: Mapping[str, Any], folder: Path, what: str) -> bool:
        spec = FunctionSpec.model_validate(function)
        missing = [text for text in _strings(spec.arguments) if not known(text)]
        if sources := [source for source in spec.sources if not source.startswith("/")]:
            needed = [name for name, is_required in declared_arguments(spec, folder).items() if is_required]
            absent = (name for name in needed if name not in spec.arguments)
            missing += [f"{sources[0]}.{name}" for name in absent if not any(known(f"{source}.{name}") for source in sources)]
        if missing:
            self.omissions.append(Omission(what, missing[0]))
        return not missing

    def _is_kept(self, known: NameFilter, name: str) -> bool:
        if known(name):
            return True
        self.omissions.append(Omission("", name))
        return False


def absolute_reference(reference: str, folder: Path) -> str:
    """Return a reference to a file, or to an object in a file, with an absolute path; Python modules stay as they are."""
    file = _reference_file(reference)
    is_module = file != reference and not file.endswith((".py", ".mo"))
    return reference if is_module else f"{(folder / file).resolve()}{reference.removeprefix(file)}"


def _reference_file(reference: str) -> str:
    """Return the file of a reference such as "my.fmu" or "my.py:Class"."""
    return reference.rpartition(":")[0] or reference


def _strings(value: Any) -> Iterator[str]:
    """Yield all strings in an argument of a KPI or figure."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | list):
        for item in value.values() if isinstance(value, Mapping) else value:
            yield from _strings(item)
