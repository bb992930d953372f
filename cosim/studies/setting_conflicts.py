"""Settings of which one would have no effect, because another one sets the same place of the scenario."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from ..scenario.nested_systems import pointer_keys


class _Setting(NamedTuple):
    """Whose setting it is, how it is written, and the keys that lead to its place in the scenario."""

    owner: str
    text: str
    place: tuple[str, ...]

    @property
    def pointer(self) -> bool:
        """Whether it changes the scenario's JSON; variables are set after all that."""
        return self.text.startswith("/")

    @property
    def part(self) -> bool:
        """Whether it is within an object that is set."""
        return self.place != _place(self.text)

    def conflict(self, other: _Setting) -> str:
        if self.text == other.text:
            return f'both {other.owner} and {self.owner} set "{self.text}"'
        return f'both {other.owner} and {self.owner} set the same thing, as "{other.text}" and as "{self.text}"'


def _settings(owner: str, pairs: Iterable[tuple[str, Any]]) -> list[_Setting]:
    """What is set, also within objects."""
    return list(dict.fromkeys(_Setting(owner, text, place) for text, value in pairs for place in _places(_place(text), value)))


def _place(text: str) -> tuple[str, ...]:
    """A variable is a parameter of the component that its name begins with."""
    if text.startswith("/"):
        return (*pointer_keys(text),)
    component, dot, variable = text.partition(".")
    return ("components", component, "parameters", variable) if dot else (text,)


def _places(place: tuple[str, ...], value: Any) -> Iterator[tuple[str, ...]]:
    yield place
    for key, inner in value.items() if isinstance(value, dict) else ():
        yield from _places((*place, key), inner)


def set_once(common: Mapping[str, Any], setters: Iterable[tuple[str, Iterable[tuple[str, Any]]]]) -> None:
    """Raises ValueError where one of two settings would have no effect.

    `setters` are (name, settings) in the order in which they are applied. They may change what is `common` to all runs, and
    variables that are common to all runs may change parts of objects that they set.
    """
    defaults = _settings("the settings", common.items())
    known = {each.place: each for each in defaults if not each.pointer}
    beneath = _beneath(defaults)
    for name, pairs in setters:
        own = _settings(f'"{name}"', pairs)
        for each in own:
            other = known.get(each.place)
            if other and (other not in defaults or not (each.part or each.text == other.text)):
                raise ValueError(each.conflict(other))
            if each.pointer and (other := beneath.get(each.place)):
                raise ValueError(f'"{each.text}" of {each.owner} replaces "{other.text}" of {other.owner}')
        known |= {each.place: each for each in own}
        beneath |= _beneath(own)


def _beneath(settings: Iterable[_Setting]) -> dict[tuple[str, ...], _Setting]:
    """For every place that something is set within: one such setting."""
    pointers = [each for each in settings if each.pointer and not each.part]
    return {each.place[:depth]: each for each in pointers for depth in range(1, len(each.place))}
