"""Detection of settings without effect, because another setting changes the same part of the scenario."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from ..scenario.json_document import pointer_keys
from ..scenario.schema_types import PlacedError


class _Setting(NamedTuple):
    """Setting of a factor, parameter or case.

    Its owner, its name, and its path of keys in the scenario.
    """

    owner: str
    name: str
    path: tuple[str, ...]

    @property
    def is_pointer(self) -> bool:
        """True if the setting changes the scenario's JSON.

        Variables are set after all JSON changes.
        """
        return self.name.startswith("/")

    @property
    def is_nested(self) -> bool:
        """True if the setting is part of an object that is set."""
        return self.path != _setting_path(self.name)

    def conflict_message(self, other: _Setting) -> str:
        """Return the message about an `other` setting of the same path."""
        if self.name == other.name:
            return f'both {other.owner} and {self.owner} set "{self.name}"'
        return (
            f'both {other.owner} and {self.owner} set the same value, as "{other.name}" and as '
            f'"{self.name}"'
        )


def _expand_settings(owner: str, pairs: Iterable[tuple[str, Any]]) -> list[_Setting]:
    """Return the settings, including one for each part of an object."""
    return list(
        dict.fromkeys(
            _Setting(owner, text, path)
            for text, value in pairs
            for path in _nested_paths(_setting_path(text), value)
        )
    )


def _setting_path(text: str) -> tuple[str, ...]:
    """Return the path of keys that a setting changes.

    A variable is a parameter of its component.
    """
    if text.startswith("/"):
        return (*pointer_keys(text),)
    component, dot, variable = text.partition(".")
    return ("components", component, "parameters", variable) if dot else (text,)


def _nested_paths(path: tuple[str, ...], value: Any) -> Iterator[tuple[str, ...]]:
    yield path
    for key, inner in value.items() if isinstance(value, dict) else ():
        yield from _nested_paths((*path, key), inner)


class Setter(NamedTuple):
    """Factor, parameter, seeds or cases: its name, its path in the study file, and its settings."""

    name: str
    path: tuple[str | int, ...]
    settings: Iterable[tuple[str, Any]]


def check_conflicts(common: Mapping[str, Any], setters: Iterable[Setter]) -> None:
    """Raise PlacedError if one of two settings would have no effect.

    Args:
        common: settings of all runs. Setters may override them; variables among them may change
            parts of objects that setters set.
        setters: factors, seeds, cases or parameters, in the order in which they are applied.
    """
    defaults = _expand_settings("the settings", common.items())
    known = {each.path: each for each in defaults if not each.is_pointer}
    pointers_by_path = _pointers_by_ancestor(defaults)
    for name, path, pairs in setters:
        settings = _expand_settings(f'"{name}"', pairs)
        for each in settings:
            other = known.get(each.path)
            if other and (other not in defaults or not (each.is_nested or each.name == other.name)):
                raise PlacedError(each.conflict_message(other), *path)
            if each.is_pointer and (other := pointers_by_path.get(each.path)):
                raise PlacedError(
                    f'"{each.name}" of {each.owner} replaces "{other.name}" of {other.owner}', *path
                )
        known |= {each.path: each for each in settings}
        pointers_by_path |= _pointers_by_ancestor(settings)


def _pointers_by_ancestor(settings: Iterable[_Setting]) -> dict[tuple[str, ...], _Setting]:
    """Return, for every path within which a JSON pointer sets a value, one such setting."""
    pointers = [each for each in settings if each.is_pointer and not each.is_nested]
    return {each.path[:depth]: each for each in pointers for depth in range(1, len(each.path))}
