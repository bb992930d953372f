"""Scenarios with a candidate in the place of the shipped controller.

What a scenario says about variables that the candidate does not have (parameters, connections to inputs, KPIs of its signals)
is left out and noted. References are left out: another controller flies another way.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...core.errors import InputError, did_you_mean
from ...results.files import write_json
from ...scenario.json_document import read_document
from ...scenario.nested_systems import load_scenario
from ...scenario.schema import SOURCES
from .candidate import CandidateInterface, CandidateSource
from .role import Role

#: name of something in a system -> whether it is still there
NameFilter = Callable[[str], bool]
_FIRST_PART = re.compile(r"[^.\[]*")


@dataclass
class ControllerSubstitution:
    """One scenario with the candidate in it, started with `parameters` of its own beside those of the scenario.

    `places` are its full names there, `notes` what was left out.
    """

    role: Role
    candidate: CandidateSource
    interface: CandidateInterface
    file: Path
    parameters: Mapping[str, Any] = field(default_factory=dict)
    replaced_components: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    _folder: Path = field(init=False)

    def write(self, folder: Path) -> Path | None:
        """Write the changed scenario, and what it consists of, to `folder`; None when it has no place of this role.

        Raises InputError for a bad scenario; JSON without components is none at all.
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
        """A system with the candidate in it, and what of its names still means something."""
        inside: dict[str, NameFilter] = {}
        components = {
            name: self._substitute_component(spec, folder, f"{prefix}{name}", name, inside)
            for name, spec in value["components"].items()
        }

        def known(name: str) -> bool:
            component, _, rest = name.partition(".")
            return component not in inside or inside[component](rest)

        for name in inside:
            spec = components[name]
            parameters = {key: v for key, v in spec.get("parameters", {}).items() if self._is_kept(known, f"{name}.{key}")}
            components[name] = {**spec, "parameters": parameters}
        connections = [each for each in value.get("connections", []) if self._is_kept(known, each["to"])]
        return {**value, "components": components, "connections": connections}, known

    def _substitute_component(
        self, spec: Mapping[str, Any], folder: Path, full_name: str, name: str, inside: dict[str, NameFilter]
    ) -> dict[str, Any]:
        kind = next(source for source in SOURCES if source in spec)
        path = (folder / _reference_file(spec[kind])).resolve()
        if path in self.role.controllers:
            self.replaced_components.append(full_name)
            inside[name] = self.interface.has_variables
            period = {key: value for key, value in spec.items() if key == "period"}
            return {**self.candidate.entry, **period, "parameters": {**spec.get("parameters", {}), **self.parameters}}
        system = self.role.stand_ins.get(path, path if kind == "system" else None)
        nested = self._substitute_nested(system, full_name) if system else None
        if nested is None:
            return {**spec, kind: absolute_reference(spec[kind], folder)}
        changed, inside[name] = nested
        return {key: value for key, value in spec.items() if key not in (kind, "isolation")} | {"system": str(changed)}

    def _substitute_nested(self, file: Path, full_name: str) -> tuple[Path, NameFilter] | None:
        """A nested system's changed file and what of its names is left, None when it has no place."""
        before = len(self.replaced_components)
        value, known = self._substitute_system(read_document(file).value, file.parent, f"{full_name}.")
        if len(self.replaced_components) == before:
            return None
        ports, lost = self._prune_ports(value.get("ports", {}), known)
        path = self._folder / "systems" / f"{self.file.stem}.{full_name}.json"
        write_json({**value, "ports": ports}, path)
        shown = {port for kind in ports.values() for port in kind}

        def known_outside(name: str) -> bool:
            port = _FIRST_PART.match(name)[0]  # type: ignore[index]
            return port in shown or (port not in lost and known(name))

        return path, known_outside

    def _prune_ports(self, ports: Mapping[str, Any], known: NameFilter) -> tuple[dict[str, Any], set[str]]:
        """Ports that lead somewhere, and the names of those that do not."""
        kept: dict[str, dict[str, Any]] = {kind: {} for kind in ports}
        lost = set()
        for kind, named in ports.items():
            for port, inner in named.items():
                left = [name for name in ([inner] if isinstance(inner, str) else inner) if known(name)]
                if left:
                    kept[kind][port] = left[0] if isinstance(inner, str) else left
                else:
                    lost.add(port)
        return kept, lost

    # -- the scenario's own keys ---------------------------------------------------------------------------------------

    def _prune_scenario(self, value: dict[str, Any], known: NameFilter, folder: Path) -> dict[str, Any]:
        signals = [name for name in value.get("record", {}).get("signals", ["*"]) if "*" in name or known(name)]
        functions = {
            key: [
                {**each, "python": absolute_reference(each["python"], folder)}
                for each in value.get(key, [])
                if self._all_known(known, each.get("arguments", {}), f'{key[:-1]} "{each["name"]}"')
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

    def _all_known(self, known: NameFilter, arguments: Any, what: str) -> bool:
        gone = [text for text in _strings(arguments) if not known(text)]
        if gone:
            self.notes.append(f'{what} is left out: the candidate has no "{gone[0]}"')
        return not gone

    def _is_kept(self, known: NameFilter, name: str) -> bool:
        if known(name):
            return True
        hint = did_you_mean(name.partition(".")[2], self.interface.names) if len(self.interface.names) > 8 else ""
        self.notes.append(f'"{name}" is left out: the candidate has nothing of that name{hint}')
        return False


def absolute_reference(reference: str, folder: Path) -> str:
    """A file, or something in a file, named from anywhere; modules of Python as they are."""
    file = _reference_file(reference)
    is_module = file != reference and not file.endswith((".py", ".mo"))
    return reference if is_module else f"{(folder / file).resolve()}{reference.removeprefix(file)}"


def _reference_file(reference: str) -> str:
    """The file in "my.fmu" or "my.py:Class"."""
    return reference.rpartition(":")[0] or reference


def _strings(value: Any) -> Iterator[str]:
    """All texts in an argument of a KPI or figure."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | list):
        for item in value.values() if isinstance(value, Mapping) else value:
            yield from _strings(item)
