"""Scenarios in which a candidate replaces the shipped controller.

Entries of a scenario that refer to variables which the candidate lacks (parameters, connections to
inputs, KPIs of its signals) are removed and noted. A parameter of the role that the candidate
declares without its prefix is renamed. References are removed, since another controller gives other
trajectories.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ...core.errors import InputError
from ...core.json_values import JsonObject
from ...results.files import write_json
from ...scenario.component_schema import change_paths
from ...scenario.component_sources import kind_of, texts_in
from ...scenario.evaluation_schema import FunctionSpec
from ...scenario.extension import nested_content
from ...scenario.file_paths import relocating
from ...scenario.named_functions import declared_arguments
from ...scenario.nested_systems import load_scenario
from .candidate import CandidateInterface, CandidateSource
from .role import Role


class NewName(NamedTuple):
    """Name of a variable in a changed system.

    Attributes:
        name: the name.
        lacking: variable of the candidate that does not exist, such as "vtol.landing_time"; "": the
            name is valid.
        own: full name of the component that is the candidate, and its variable; None: the name is
            of something else.
    """

    name: str
    lacking: str = ""
    own: tuple[str, str] | None = None


#: returns the new name for a name of the unchanged system
NameMap = Callable[[str], NewName]
#: end of the first part of a name
_SEPARATOR = re.compile(r"[.\[]")


@dataclass(frozen=True)
class Omission:
    """Entry of a scenario that is left out because the candidate lacks a variable.

    Attributes:
        entry: 'kpi "descent"' or 'figure "landing"'; "" for a value of the variable or a connection
            to it.
        variable: full name of the variable in the scenario, such as "demo1.landing_time".
        lacking: name of the variable that the candidate would need for it, such as
            "vtol.landing_time".
    """

    entry: str
    variable: str
    lacking: str

    def __str__(self) -> str:
        entry = self.entry or f'"{self.variable}"'
        return f'{entry} is left out: the candidate has no "{self.lacking}"'


@dataclass
class ControllerSubstitution:
    """Substitution of the candidate for the controllers of a role in one scenario.

    Attributes:
        role: the role.
        candidate: the candidate's source.
        interface: the candidate's variables.
        file: the scenario's file.
        parameters: parameters of the candidate in addition to those of the scenario.
        replaced_components: names of the replaced controllers, such as "ar_drone_cascaded", by the
            full names of the components.
        omissions: removed entries.
        applied_settings: values that the candidate gets, by the full names of its components and
            its own variables.
        changed_files: content of the changed scenario and of its nested systems by path.
    """

    role: Role
    candidate: CandidateSource
    interface: CandidateInterface
    file: Path
    parameters: Mapping[str, Any] = field(default_factory=dict)
    replaced_components: dict[str, str] = field(default_factory=dict)
    omissions: list[Omission] = field(default_factory=list)
    applied_settings: dict[str, dict[str, Any]] = field(default_factory=dict)
    changed_files: dict[Path, dict[str, Any]] = field(default_factory=dict)
    _folder: Path = field(init=False)

    def substitute(self, folder: Path) -> Path | None:
        """Change the scenario and its nested systems, as files in `folder`; they are not written.

        Returns:
            Path of the changed scenario among `changed_files`; None if no component has the role,
            or if the file is not a scenario (has no components).

        Raises:
            InputError: if the scenario is invalid.
        """
        loaded = load_scenario(self.file)
        if "components" not in loaded.root.document.value:
            return None
        if loaded.problems:
            raise InputError(loaded.problems)
        self._folder, origin = folder, self.file.parent.resolve()
        changed, renamed = self._substitute_system(loaded.root.document.value, origin, "")
        if not self.replaced_components:
            return None
        path = folder / self.file.name
        self.changed_files[path] = self._prune_scenario(changed, renamed, origin)
        return path

    def write_files(self) -> None:
        """Write the changed scenario and its nested systems."""
        for path, content in self.changed_files.items():
            write_json(content, path)

    # -- systems
    # ---------------------------------------------------------------------------------------

    def _substitute_system(
        self, value: JsonObject, folder: Path, prefix: str
    ) -> tuple[dict[str, Any], NameMap]:
        """Return a system that contains the candidate, and a map of the names that exist in it."""
        value = change_paths(value, relocating(folder, None))
        maps: dict[str, NameMap] = {}
        components = {
            name: self._substitute_component(spec, folder, f"{prefix}{name}", name, maps)
            for name, spec in value["components"].items()
        }

        def renamed(name: str) -> NewName:
            component, _, rest = name.partition(".")
            new = maps[component](rest) if component in maps and rest else NewName(rest)
            return NewName(f"{component}.{new.name}" if rest else name, new.lacking, new.own)

        for name in maps:
            given = components[name].get("parameters", {})
            parameters = self._known_settings(maps[name], given, f"{name}.")
            own = self.parameters if f"{prefix}{name}" in self.replaced_components else {}
            components[name] = {**components[name], "parameters": {**parameters, **own}}
            applied = {maps[name](each).own: setting for each, setting in given.items()}
            applied |= {(f"{prefix}{name}", each): setting for each, setting in own.items()}
            for owner, setting in applied.items():
                if owner:
                    self.applied_settings.setdefault(owner[0], {})[owner[1]] = setting
        connections = []
        for each in value.get("connections", []):
            if new := self._kept_name(renamed, each["to"]):
                connections.append({**each, "to": new})
        return {**value, "components": components, "connections": connections}, renamed

    def _substitute_component(
        self,
        spec: JsonObject,
        folder: Path,
        full_name: str,
        name: str,
        maps: dict[str, NameMap],
    ) -> dict[str, Any]:
        kind = kind_of(spec).KEY
        source = spec[kind]
        path = folder
        if isinstance(source, str):  # a file, or "my.py:Class"
            path = Path(source.rpartition(":")[0] or source).resolve()
        if path in self.role.controllers:
            self.replaced_components[full_name] = path.stem
            maps[name] = partial(self._candidate_name, full_name)
            return {
                **self.candidate.entry,
                **{key: spec[key] for key in ("period", "parameters") if key in spec},
            }
        stand_in = self.role.stand_ins.get(path)
        content = nested_content({"system": str(stand_in)} if stand_in else spec, folder)
        nested = self._substitute_nested(*content, full_name) if content else None
        if nested is None:
            return dict(spec)
        changed, maps[name] = nested
        return {key: value for key, value in spec.items() if key not in (kind, "isolation")} | {
            "system": str(changed)
        }

    def _candidate_name(self, component: str, name: str) -> NewName:
        """Return the candidate's name of a variable.

        A parameter of the role may lack its prefix.
        """
        if self.interface.has_variables(name):
            return NewName(name, own=(component, name))
        short = self.role.short_names.get(name, "")
        return (
            NewName(short, own=(component, short))
            if short in self.interface.parameters
            else NewName(name, name)
        )

    def _substitute_nested(
        self, system: JsonObject, folder: Path, full_name: str
    ) -> tuple[Path, NameMap] | None:
        """Change a nested system that contains a controller of the role.

        Return its path and name map, or None if no component has the role.
        """
        before = len(self.replaced_components)
        value, renamed = self._substitute_system(system, folder, f"{full_name}.")
        if len(self.replaced_components) == before:
            return None
        ports, lost = self._prune_ports(value.get("ports", {}), renamed)
        path = self._folder / "systems" / f"{self.file.stem}.{full_name}.json"
        self.changed_files[path] = {**value, "ports": ports}
        shown: dict[str, Any] = {}
        for kind, named in value.get("ports", {}).items():
            shown |= {port: inner for port, inner in named.items() if port in ports[kind]}

        def renamed_outside(name: str) -> NewName:
            port = _SEPARATOR.split(name, 1)[0]
            if port in shown:
                inner = [shown[port]] if isinstance(shown[port], str) else shown[port]
                targets = [renamed(each + name[len(port) :]).own for each in inner]
                return NewName(name, own=next(filter(None, targets), None))
            return NewName(name, lost[port]) if port in lost else renamed(name)

        return path, renamed_outside

    def _prune_ports(
        self, ports: JsonObject, renamed: NameMap
    ) -> tuple[dict[str, Any], dict[str, str]]:
        """Return the ports that lead to a variable of the changed system.

        Also return what is lacking for the removed ports.
        """
        remaining: dict[str, dict[str, Any]] = {kind: {} for kind in ports}
        lost = {}
        for kind, named in ports.items():
            for port, inner in named.items():
                found = [renamed(name) for name in ([inner] if isinstance(inner, str) else inner)]
                targets = [new.name for new in found if not new.lacking]
                if targets:
                    remaining[kind][port] = targets[0] if isinstance(inner, str) else targets
                else:
                    lost[port] = found[0].lacking
        return remaining, lost

    # -- the scenario's own keys
    # ---------------------------------------------------------------------------------------

    def _prune_scenario(self, value: JsonObject, renamed: NameMap, folder: Path) -> dict[str, Any]:
        """Return a scenario without the entries that refer to variables which the candidate lacks.

        References are left out.
        """
        record = value.get("record", {})
        signals = [
            name
            for name in record.get("signals", ["*"])
            if "*" in name or not renamed(name).lacking
        ]
        kept: dict[str, list[Any]] = {"kpis": [], "figures": [], "events": []}
        for key, noun in (("kpis", "kpi"), ("figures", "figure")):
            for each in value.get(key, []):
                if self._all_known(renamed, each, folder, f'{noun} "{each["name"]}"'):
                    kept[key].append(each)
        for event in value.get("events", []):
            if settings := self._known_settings(renamed, event["set"]):
                kept["events"].append({**event, "set": settings})
        kpis = {each["name"] for each in kept["kpis"]}
        checks = [each for each in value.get("checks", []) if each["kpi"].partition(".")[0] in kpis]
        pruned = {**value, **kept, "record": {**record, "signals": signals}, "checks": checks}
        pruned.pop("reference", None)
        return {**pruned, "inputs": value.get("inputs", [])}

    def _known_settings(
        self, renamed: NameMap, settings: JsonObject, prefix: str = ""
    ) -> dict[str, Any]:
        known = {}
        for name, value in settings.items():
            if new := self._kept_name(renamed, name, prefix):
                known[new] = value
        return known

    def _all_known(self, renamed: NameMap, function: JsonObject, folder: Path, what: str) -> bool:
        """Return whether all signals that a function needs exist; note the first that does not.

        An argument that `arguments_from` gives needs a variable in one of the sources.
        """
        spec = FunctionSpec.model_validate(function)
        groups = [[text] for text in texts_in(spec.arguments)]
        if sources := [source for source in spec.sources if not source.startswith("/")]:
            for name, is_required in declared_arguments(spec, folder).items():
                if is_required and name not in spec.arguments:
                    groups.append([f"{source}.{name}" for source in sources])
        for names in groups:
            lacking = [renamed(name).lacking for name in names]
            if all(lacking):
                self.omissions.append(Omission(what, names[0], lacking[0]))
                return False
        return True

    def _kept_name(self, renamed: NameMap, name: str, prefix: str = "") -> str | None:
        """Return the new name of a variable that is set or fed.

        Note it and return None if the candidate lacks it.
        """
        new = renamed(name)
        if not new.lacking:
            return new.name
        self.omissions.append(Omission("", f"{prefix}{name}", new.lacking))
        return None
