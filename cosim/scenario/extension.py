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

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from ..core import paths
from ..core.errors import InputError, Problem, did_you_mean, nearest_name
from ..core.size_limits import MAX_LEVELS
from .component_schema import change_paths
from .component_sources import NestedSystem, component_kinds, kind_of
from .file_paths import find_scenario, path_in, relocating, resolve_shipped_paths
from .included_files import include_files
from .json_document import Document, JsonPath, Origin, path_in_system, read_document
from .schema import KEYED_LISTS, NOT_INHERITED

#: entries with names -> their noun, and the keys of which an entry needs one to be new (a component
#: that of a source); without them it changes one of the base
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
    inherited = {key: each for key, each in base.value.items() if key not in NOT_INHERITED}
    old_folder, folder = base.file.parent, document.file.parent
    if paths.resolve_path(old_folder) != paths.resolve_path(folder):
        inherited = change_paths(inherited, relocating(old_folder, folder))
    changes = {key: each for key, each in value.items() if key != "extends"}
    changes |= _removals_with_components(inherited, changes)
    merged = merger.merge((), _Part(base, (), inherited), _Part(document, (), changes))
    invalid = [
        path
        for path, origin in merger.origins.items()
        if origin.path in origin.document.invalid_paths
    ]
    return replace(
        document,
        value=merged,
        problems=[*document.problems, *base.problems, *merger.problems],
        invalid_paths=invalid,
        origins=merger.origins,
        bases=(*document.bases, base.file, *base.bases),
        removed=merger.removed,
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
            Problem("expected the path of a file or the name of a shipped scenario", where)
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
        raise InputError(error.located(where)) from None
    if not isinstance(base.value, dict):
        raise InputError(Problem("expected an object", base.where(())))
    return base


def _removals_with_components(
    inherited: Mapping[str, Any], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """Return changes that remove the entries of the components that `changes` remove by `null`.

    What the extending file replaces itself is not among them.
    """
    components = changes.get("components")
    if not isinstance(components, dict):
        return {}
    removed = {name for name, each in components.items() if each is None}
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
    changed = {**connection, "from": [names[i] for i in kept]}
    if isinstance(gain, list) and len(gain) == len(names):
        changed["gain"] = [gain[i] for i in kept]
    return changed


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


class _Part(NamedTuple):
    """Value of one of the two documents; None stands for one that does not exist."""

    document: Document
    path: JsonPath
    value: Any

    def entries(self) -> dict[str | int, _Part]:
        """Return the entries of an object, or the elements of a list by index."""
        is_object = isinstance(self.value, dict)
        items: Iterable[tuple[Any, Any]] = (
            self.value.items() if is_object else enumerate(self.value)
        )
        return {key: _Part(self.document, (*self.path, key), each) for key, each in items}


class _Merger:
    """Merger of a document with its base.

    Results besides the value: `origins`, `problems`, `removed`.
    """

    def __init__(self, document: Document, base: Document) -> None:
        self._document = document
        self.origins: dict[JsonPath, Origin] = {}
        self.problems: list[Problem] = []
        self.removed = set(base.removed)

    def merge(self, path: JsonPath, old: _Part, new: _Part) -> Any:
        """Return the merged value at a path of the result."""
        if not isinstance(new.value, dict):
            return self._copy(path, new)
        match path_in_system(path):
            case (str(kind),) if kind in KEYED_LISTS:
                return self._merge_list(path, old, new, KEYED_LISTS[kind])
            case ("components", _) if isinstance(old.value, dict):
                old = old._replace(value=inherited_component(old.value, new.value))
            case ("components", _, "system") if isinstance(old.value, dict):
                if new.path in self._document.complete_systems:
                    return self._copy(path, new)
                removals = _removals_with_components(old.value, new.value)
                new = new._replace(value={**new.value, **removals})
        entries = old.entries() if isinstance(old.value, dict) else {}
        return self._merge_entries(path, entries, new, list(map(str, entries)))

    def _merge_list(self, path: JsonPath, old: _Part, new: _Part, name_key: str) -> list[Any]:
        """Merge a list of named elements with changes by name, as objects of these names."""
        elements = old.entries() if isinstance(old.value, list) else {}
        names = [
            str(each.value.get(name_key)) if isinstance(each.value, dict) else ""
            for each in elements.values()
        ]
        # elements that share a name keep their indices as keys, so that no change can mean them
        by_name: dict[str | int, _Part] = {
            i if names.count(name) > 1 else name: elements[i] for i, name in enumerate(names)
        }
        return list(self._merge_entries(path, by_name, new, names, name_key).values())

    def _merge_entries(
        self,
        path: JsonPath,
        old: Mapping[str | int, _Part],
        new: _Part,
        names: Sequence[str],
        name_key: str = "",
    ) -> dict[str | int, Any]:
        """Merge the entries of two objects.

        `names` are all names of the base. With `name_key` the entries are the elements of a list.
        """
        self.origins[path] = Origin(self._document, new.path)
        result: dict[str | int, Any] = {}
        changes = new.entries()
        for key in dict.fromkeys((*old, *changes)):
            place = (*path, len(result) if name_key else key)
            before, change = old.get(key), changes.get(key)
            if change is None:
                result[key] = self._copy(place, old[key])
            elif before is None and name_key and names.count(str(key)) > 1:
                self._report(
                    change,
                    f"the base has {names.count(str(key))} elements with this name; a list "
                    "replaces all elements",
                )
            elif change.value is None:
                if before:
                    self.removed.add((*path, key))
                else:
                    own = not path and key in NOT_INHERITED
                    hint = ", it is not inherited" if own else did_you_mean(str(key), names)
                    self._report(change, f"nothing to remove{hint}")
            elif before or not self._changes_nothing(change, names):
                if name_key and not isinstance(change.value, dict):
                    self._report(change, "expected an object, or null to remove the element")
                    change = change._replace(value={})
                nothing = _Part(self._document, (), None)
                result[key] = self.merge(place, before or nothing, change)
                if name_key and not before:
                    result[key] = {name_key: key, **result[key]}
                    self.origins[(*place, name_key)] = Origin(self._document, change.path)
        return result

    def _copy(self, path: JsonPath, part: _Part) -> Any:
        """Return a copy of a value of one of the documents."""
        self.origins[path] = part.document.origin(part.path)
        if not isinstance(part.value, dict | list):
            return part.value
        copied = {key: self._copy((*path, key), each) for key, each in part.entries().items()}
        return copied if isinstance(part.value, dict) else list(copied.values())

    def _changes_nothing(self, change: _Part, names: Collection[str]) -> bool:
        """Report a change of an entry that the base lacks, without a key that makes it new.

        A misspelt one is enough. `names` are those of the base's entries.
        """
        match path_in_system(change.path):
            case (str(kind), str(name)) if kind in _NEW_ENTRIES and isinstance(change.value, dict):
                noun, keys = _NEW_ENTRIES[kind]
            case _:
                return False
        keys = keys or tuple(component_kinds(None))
        if any(key in keys or nearest_name(key, keys) for key in change.value):
            return False
        near = nearest_name(name, names)
        hint = (
            f'; did you mean "{near}"?'
            if near
            else f"; a new one needs {' or '.join(keys)}{did_you_mean(name, names)}"
        )
        base = self._document.value["extends"]
        self._report(change, f'the base "{base}" has no {noun} "{name}"{hint}')
        return True

    def _report(self, change: _Part, text: str) -> None:
        self.problems.append(Problem(text, self._document.where(change.path)))


def inherited_component(old: Mapping[str, Any], new: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a component inherits that `new` changes.

    All of it, unless `new` has a source of another kind.
    """
    kind = kind_of(new)
    if not hasattr(kind, "KEY") or kind.KEY in old or not hasattr(kind_of(old), "KEY"):
        return dict(old)
    return {key: old[key] for key in kind.KEPT_KEYS if key in old}
