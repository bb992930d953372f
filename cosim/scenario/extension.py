"""Scenarios and nested systems that extend another one.

- "extends" names a file, with or without ".json", a file that cosim ships ("cosim:..."), or a
  shipped scenario.
- Objects are merged key by key. Every other value replaces that of the base. `null` removes a key.
- The lists `connections`, `kpis`, `figures` and `checks` of the base are changed by an object whose
  keys are the names of elements: `to`, `name`, `name` and `kpi`. New names are appended.
- An entry that the base lacks needs a source, or `from`, `python` or `when`. Without one it is a
  misspelt entry of the base.
- A component that gets a source of another kind inherits only `period`, and `isolation` where it is
  valid.
- An inline nested system is merged with that of the base, unless it has an "extends" of its own.
- With a component that `null` removes go its connections, its place in the stages and its recorded
  signals.
- `name`, `description`, `reference` and `$schema` describe the base alone and are not inherited.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..core import paths
from ..core.errors import InputError, Problem, did_you_mean, nearest_name
from ..core.size_limits import MAX_LEVELS
from .component_schema import change_paths
from .component_sources import NestedSystem, component_kinds, kind_of
from .file_paths import find_scenario, path_in, relocating, resolve_shipped_paths
from .included_files import include_files
from .json_document import Document, JsonPath, Origin, path_in_system, read_document
from .schema import KEYED_LISTS, NOT_INHERITED

#: entries with names -> their noun, and the keys of which an entry needs one to be new; without
#: them it changes one of the base
_NEW_ENTRIES: Mapping[str, tuple[str, tuple[str, ...]]] = {
    "components": ("component", ()),
    "connections": ("connection to", ("from",)),
    "kpis": ("KPI", ("python",)),
    "figures": ("figure", ("python",)),
    "stop_when": ("stop condition", ("when",)),
}


def read_system_document(file: Path) -> Document:
    """Read a scenario or nested system and merge it with those that it extends.

    Raises:
        InputError: A file cannot be read or is not JSON, or "extends" is wrong.
    """
    return expand_document(read_document(file))


def nested_content(entry: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], Path] | None:
    """Return the content of the nested system of a component, and the folder of its paths.

    None if the component, as in a scenario file in `folder`, has another source.
    """
    system = entry.get(NestedSystem.KEY)
    if isinstance(system, str):
        file = folder / system
        return read_system_document(file).value, file.parent
    return (system, folder) if isinstance(system, dict) else None


def expand_document(document: Document, extending: tuple[Path, ...] = ()) -> Document:
    """Include files, resolve the paths of shipped files, and merge a document with its bases.

    Args:
        document: A scenario or nested system.
        extending: Resolved paths of the files that extend this one.

    Raises:
        InputError: A base does not exist, is not JSON, or extends itself.
    """
    document = include_files(document)
    if not isinstance(document.value, dict):
        return document
    document = replace(document, value=resolve_shipped_paths(document.value, document.file.parent))
    extending = (*extending, paths.resolve_path(document.file))
    document = _expand_inline_systems(document, extending)
    value = document.value
    if "extends" not in value:
        return document
    base = expand_document(_read_base(document, value["extends"], extending), extending)
    merger = _Merger(document, base)
    inherited = _inherited(base, document.file.parent)
    changes = {key: each for key, each in value.items() if key != "extends"}
    merged = merger.merge_objects(
        (), inherited, {**changes, **_removals_with_components(inherited, changes)}
    )
    invalid = [
        path
        for path, origin in merger.origins.items()
        if origin.path in origin.document.invalid_paths
    ]
    problems = [*document.problems, *base.problems, *merger.problems]
    bases = (*document.bases, base.file, *base.bases)
    origins, removed = merger.origins, merger.removed
    return replace(
        document,
        value=merged,
        problems=problems,
        invalid_paths=invalid,
        origins=origins,
        bases=bases,
        removed=removed,
    )


def _inline_systems(system: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (name, component) of the components that are inline nested systems."""
    components = system.get("components") if isinstance(system, dict) else None
    for name, component in components.items() if isinstance(components, dict) else ():
        if isinstance(component, dict) and isinstance(component.get(NestedSystem.KEY), dict):
            yield name, component


def _expand_inline_systems(document: Document, extending: tuple[Path, ...]) -> Document:
    """Expand each inline nested system like a file of its own in the same folder."""
    for name, component in _inline_systems(document.value):
        path = ("components", name, "system")
        inner = expand_document(document.part(path), extending)
        components = document.value["components"]
        changed = {**components, name: {**component, "system": inner.value}}
        origins = {(*path, *each): origin for each, origin in inner.origins.items() if each}
        outside = [each for each in document.invalid_paths if each[:3] != path]
        invalid = [*outside, *((*path, *each) for each in inner.invalid_paths)]
        complete = {(*path, *each) for each in inner.complete_systems}
        document = replace(
            document,
            value={**document.value, "components": changed},
            problems=[*document.problems, *inner.problems],
            invalid_paths=invalid,
            origins={**document.origins, **origins},
            bases=(*document.bases, *inner.bases),
            removed=document.removed | {(*path, *each) for each in inner.removed},
            complete_systems=document.complete_systems
            | complete
            | ({path} if "extends" in component["system"] else set()),
        )
    return document


def expand_set_systems(document: Document, path: JsonPath = ()) -> None:
    """Expand the inline nested systems that settings have put into a scenario, which is changed."""
    system = document.part(path).value
    for name, component in _inline_systems(system):
        place = (*path, "components", name, "system")
        if any(place[:n] in document.settings for n in range(1, len(place) + 1)):
            inner = expand_document(document.part(place), (paths.resolve_path(document.file),))
            component["system"] = inner.value
            document.problems += inner.problems
            document.bases += inner.bases
        else:
            expand_set_systems(document, place)


def _read_base(document: Document, name: Any, extending: tuple[Path, ...]) -> Document:
    where = document.where(("extends",))
    if not isinstance(name, str):
        raise InputError(
            [Problem("expected the path of a file or the name of a shipped scenario", where)]
        )
    near = path_in(document.file.parent, name if name.endswith(".json") else f"{name}.json")
    try:
        file = near if paths.is_file(near) or name.endswith(".json") else find_scenario(name)
        if paths.resolve_path(file) in extending:
            raise InputError(f'"{name}" extends itself')
        if len(extending) > MAX_LEVELS:
            raise InputError(f"more than {MAX_LEVELS} files extend each other")
        base = read_document(file)
    except InputError as error:
        raise InputError(
            [Problem(problem.message, problem.where or where) for problem in error.problems]
        ) from None
    if not isinstance(base.value, dict):
        raise InputError([Problem("expected an object", base.where(()))])
    return base


def _inherited(base: Document, folder: Path) -> dict[str, Any]:
    """Return what a file in `folder` inherits, with paths relative to this folder."""
    value = {key: each for key, each in base.value.items() if key not in NOT_INHERITED}
    if paths.resolve_path(base.file.parent) == paths.resolve_path(folder):
        return value
    return change_paths(value, relocating(base.file.parent, folder))


def _removals_with_components(
    inherited: Mapping[str, Any], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return changes that remove the entries of the components that `changes` remove by `null`.

    What the extending file replaces itself is not among them.
    """
    components = changes.get("components")
    removed = (
        {name for name, each in components.items() if each is None}
        if isinstance(components, dict)
        else set()
    )
    if not removed:
        return {}
    result: dict[str, Any] = {}
    connections, own = inherited.get("connections"), changes.get("connections", {})
    if isinstance(connections, list) and isinstance(own, dict):
        gone: dict[str, Any] = {}
        for each in connections:
            if isinstance(each, dict) and isinstance(each.get("to"), str):
                change = _without_sources(each, removed)
                if change != each:
                    gone[each["to"]] = change
        result["connections"] = {**gone, **own}
    for key, entry in (("algorithm", "stages"), ("record", "signals")):
        old, own = inherited.get(key), changes.get(key, {})
        if (
            isinstance(old, dict)
            and isinstance(old.get(entry), list)
            and isinstance(own, dict)
            and entry not in own
        ):
            result[key] = {**own, entry: _without_components(old[entry], removed)}
    return result


def _without_sources(connection: Mapping[str, Any], removed: Set[str]) -> Mapping[str, Any] | None:
    """Return a connection without outputs of removed components; None if nothing remains."""
    sources, gain = connection.get("from"), connection.get("gain")
    names = sources if isinstance(sources, list) else [sources]
    kept = [i for i, name in enumerate(names) if _component_of(name) not in removed]
    if not kept or _component_of(connection["to"]) in removed:
        return None
    if len(kept) == len(names):
        return connection
    gains = (
        {"gain": [gain[i] for i in kept]}
        if isinstance(gain, list) and len(gain) == len(names)
        else {}
    )
    return {**connection, "from": [names[i] for i in kept], **gains}


def _without_components(names: Sequence[Any], removed: Set[str]) -> list[Any]:
    """Return a list of names, or of lists of names, without those of removed components.

    Lists that become empty are left out.
    """
    kept = [
        _without_components(each, removed) if isinstance(each, list) else each for each in names
    ]
    return [each for each in kept if each != [] and _component_of(each) not in removed]


def _component_of(name: Any) -> str:
    """Return the component of a name as "component.variable"."""
    return name.partition(".")[0] if isinstance(name, str) else ""


def _new_entry(kind: str) -> tuple[str, tuple[str, ...]]:
    """Return the noun of an entry, and the keys of which it needs one to be new."""
    noun, keys = _NEW_ENTRIES.get(kind, ("", ()))
    return noun, tuple(component_kinds(None)) if kind == "components" else keys


def _is_change_of_nothing(kind: str, new: Any) -> bool:
    """Return True if an entry that the base lacks has no key that makes it new, even misspelt."""
    _, keys = _new_entry(kind)
    return (
        isinstance(new, dict)
        and bool(keys)
        and not any(key in keys or nearest_name(key, keys) for key in new)
    )


class _Merger:
    """Merger of a document with its base.

    Results besides the value: `origins`, `problems`, `removed`.
    """

    def __init__(self, document: Document, base: Document) -> None:
        self._document, self._base = document, base
        self.origins: dict[JsonPath, Origin] = {(): Origin(document, ())}
        self.problems: list[Problem] = []
        self.removed = set(base.removed)

    def merge_objects(
        self,
        path: JsonPath,
        old: Mapping[str, Any],
        new: Mapping[str, Any],
        old_path: JsonPath = (),
        new_path: JsonPath = (),
    ) -> dict[str, Any]:
        """Merge two objects.

        The paths are those of the result and of the two objects in their documents.
        """
        result = {}
        for key in dict.fromkeys((*old, *new)):
            places = ((*path, key), (*old_path, key), (*new_path, key))
            if key not in new:
                result[key] = self._copy(self._base, places[0], old[key], places[1])
            elif (
                path_in_system(path) == ("components",)
                and key not in old
                and _is_change_of_nothing("components", new[key])
            ):
                self._report_unknown(places[2], old)
            elif new[key] is not None:
                result[key] = self._merge(*places, old.get(key), new[key])
            elif key in old:
                self.removed.add(places[0])
            else:
                own = not path and key in NOT_INHERITED
                self._report(
                    places[2],
                    (
                        "nothing to "
                        f"remove{', it is not inherited' if own else did_you_mean(key, old)}"
                    ),
                )
        return result

    def _merge(
        self, path: JsonPath, old_path: JsonPath, new_path: JsonPath, old: Any, new: Any
    ) -> Any:
        """Merge two values; `old` is None if the base has no such value."""
        if isinstance(new, dict):
            self.origins[path] = Origin(self._document, new_path)
            match path_in_system(path):
                case (kind,) if path_in_system(path) in KEYED_LISTS:
                    key = KEYED_LISTS[(str(kind),)]
                    return self._merge_list(
                        path, old_path, new_path, key, old if isinstance(old, list) else [], new
                    )
                case ("components", _) if isinstance(old, dict):
                    old = inherited_component(old, new)
                case ("components", _, "system") if isinstance(old, dict):
                    if new_path in self._document.complete_systems:
                        return self._copy(self._document, path, new, new_path)
                    new = {**new, **_removals_with_components(old, new)}
            return self.merge_objects(
                path, old if isinstance(old, dict) else {}, new, old_path, new_path
            )
        return self._copy(self._document, path, new, new_path)

    def _merge_list(
        self,
        path: JsonPath,
        old_path: JsonPath,
        new_path: JsonPath,
        key: str,
        old: list[Any],
        new: Mapping[str, Any],
    ) -> list[Any]:
        """Merge a list of named elements with changes by name."""
        kind = str(path[-1])
        names = [str(element.get(key)) if isinstance(element, dict) else "" for element in old]
        result: list[Any] = []
        for i, name in enumerate(names):
            place, old_place = (*path, len(result)), (*old_path, i)
            if name not in new or names.count(name) > 1:
                result.append(self._copy(self._base, place, old[i], old_place))
            elif new[name] is not None:
                new_place = (*new_path, name)
                result.append(self._merge_element(place, old_place, new_place, old[i], new[name]))
        for name, change in new.items():
            new_place = (*new_path, name)
            if names.count(name) > 1:
                self._report(
                    new_place,
                    f"the base has {names.count(name)} elements with this name; a list "
                    "replaces all elements",
                )
            elif name not in names and change is None:
                self._report(new_place, f"nothing to remove{did_you_mean(name, names)}")
            elif name not in names and _is_change_of_nothing(kind, change):
                self._report_unknown(new_place, names)
            elif name not in names:
                place = (*path, len(result))
                result.append({key: name, **self._merge_element(place, (), new_place, {}, change)})
                self.origins[(*place, key)] = Origin(self._document, new_place)
        return result

    def _merge_element(
        self, path: JsonPath, old_path: JsonPath, new_path: JsonPath, old: Any, new: Any
    ) -> dict[str, Any]:
        if not isinstance(new, dict):
            self._report(new_path, "expected an object, or null to remove the element")
            new = {}
        self.origins[path] = Origin(self._document, new_path)
        return self.merge_objects(path, old, new, old_path, new_path)

    def _copy(self, document: Document, path: JsonPath, value: Any, old_path: JsonPath) -> Any:
        """Return a copy of a value that one of the documents has at `old_path`."""
        self.origins[path] = document.origin(old_path)
        if isinstance(value, dict):
            return {
                key: self._copy(document, (*path, key), each, (*old_path, key))
                for key, each in value.items()
            }
        if isinstance(value, list):
            return [
                self._copy(document, (*path, i), each, (*old_path, i))
                for i, each in enumerate(value)
            ]
        return value

    def _report_unknown(self, path: JsonPath, names: Collection[str]) -> None:
        """Report a change of an entry that the base lacks; `names` are those of its entries."""
        noun, keys = _new_entry(str(path[-2]))
        name = str(path[-1])
        near = nearest_name(name, names)
        hint = (
            f'; did you mean "{near}"?'
            if near
            else f"; a new one needs {' or '.join(keys)}{did_you_mean(name, names)}"
        )
        self._report(
            path, f'the base "{self._document.value["extends"]}" has no {noun} "{name}"{hint}'
        )

    def _report(self, path: JsonPath, text: str) -> None:
        self.problems.append(Problem(text, self._document.where(path)))


def inherited_component(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a component inherits that `new` changes.

    All of it, unless `new` has a source of another kind.
    """
    kind = kind_of(new)
    if not hasattr(kind, "KEY") or kind.KEY in old or not hasattr(kind_of(old), "KEY"):
        return dict(old)
    return {key: old[key] for key in kind.KEPT_KEYS if key in old}
