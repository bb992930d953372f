"""Settings of which one would have no effect, because another one sets the same place of the scenario."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from ..scenario.nested_systems import pointer_keys


class _Setting(NamedTuple):
    """Whose setting it is, how it is written, and the keys that lead to its place in the scenario."""

    owner: str
    name: str
    path: tuple[str, ...]

    @property
    def is_pointer(self) -> bool:
        """Whether it changes the scenario's JSON; variables are set after all that."""
        return self.name.startswith("/")

    @property
    def is_nested(self) -> bool:
        """Whether it is within an object that is set."""
        return self.path != _setting_path(self.name)

    def conflict_message(self, other: _Setting) -> str:
        if self.name == other.name:
            return f'both {other.owner} and {self.owner} set "{self.name}"'
        return f'both {other.owner} and {self.owner} set the same thing, as "{other.name}" and as "{self.name}"'


def _expand_settings(owner: str, pairs: Iterable[tuple[str, Any]]) -> list[_Setting]:
    """What is set, also within objects."""
    return list(
        dict.fromkeys(
            _Setting(owner, text, place) for text, value in pairs for place in _nested_paths(_setting_path(text), value)
        )
    )


def _setting_path(text: str) -> tuple[str, ...]:
    """A variable is a parameter of the component that its name begins with."""
    if text.startswith("/"):
        return (*pointer_keys(text),)
    component, dot, variable = text.partition(".")
    return ("components", component, "parameters", variable) if dot else (text,)


def _nested_paths(place: tuple[str, ...], value: Any) -> Iterator[tuple[str, ...]]:
    yield place
    for key, inner in value.items() if isinstance(value, dict) else ():
        yield from _nested_paths((*place, key), inner)


def check_conflicts(common: Mapping[str, Any], setters: Iterable[tuple[str, Iterable[tuple[str, Any]]]]) -> None:
    """Raises ValueError where one of two settings would have no effect.

    `setters` are (name, settings) in the order in which they are applied. They may change what is `common` to all runs, and
    variables that are common to all runs may change parts of objects that they set.
    """
    defaults = _expand_settings("the settings", common.items())
    known = {each.path: each for each in defaults if not each.is_pointer}
    beneath = _pointers_by_ancestor(defaults)
    for name, pairs in setters:
        own = _expand_settings(f'"{name}"', pairs)
        for each in own:
            other = known.get(each.path)
            if other and (other not in defaults or not (each.is_nested or each.name == other.name)):
                raise ValueError(each.conflict_message(other))
            if each.is_pointer and (other := beneath.get(each.path)):
                raise ValueError(f'"{each.name}" of {each.owner} replaces "{other.name}" of {other.owner}')
        known |= {each.path: each for each in own}
        beneath |= _pointers_by_ancestor(own)


def _pointers_by_ancestor(settings: Iterable[_Setting]) -> dict[tuple[str, ...], _Setting]:
    """For every place that something is set within: one such setting."""
    pointers = [each for each in settings if each.is_pointer and not each.is_nested]
    return {each.path[:depth]: each for each in pointers for depth in range(1, len(each.path))}
