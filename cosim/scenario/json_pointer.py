"""JSON pointers (RFC 6901) into scenario files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..core.errors import abbreviate_names, nearest_name
from ..core.text import count_noun, shorten

#: keys of objects that are created when a value in them is set
_OPTIONAL_OBJECTS = ("parameters", "arguments")


def pointer_keys(pointer: str) -> list[str]:
    """Return the keys and indices of a JSON pointer.

    >>> pointer_keys("/components/uav/and~1or")
    ['components', 'uav', 'and/or']
    """
    return [key.replace("~1", "/").replace("~0", "~") for key in pointer[1:].split("/")]


def find_value(value: Any, keys: Sequence[str]) -> tuple[Any, int]:
    """Follow keys and indices into a JSON value.

    Returns:
        The deepest value that exists, and the number of keys that lead to it.
    """
    for depth, key in enumerate(keys):
        if isinstance(value, dict) and key in value:
            value = value[key]
        elif isinstance(value, list) and key.isdigit() and int(key) < len(value):
            value = value[int(key)]
        else:
            return value, depth
    return value, len(keys)


def missing_value(document: Any, pointer: str) -> str:
    """Return the message about a JSON pointer to no value, with the keys at the deepest place that exists.

    >>> missing_value({"environment": {"sea_state": 2, "seed": 1}}, "/environment/waves/direction")
    'the scenario has no "/environment/waves"; "environment" has: sea_state, seed'
    """
    keys = pointer_keys(pointer)
    value, depth = find_value(document, keys)
    return (
        "the scenario has no "
        f'"/{"/".join(keys[: depth + 1])}"{_present_keys(keys[:depth], keys[depth], value)}'
    )


def _present_keys(place: Sequence[str], key: str, value: Any) -> str:
    """Return a hint for the end of a message.

    The key at a place that another one probably means, else all keys there.
    """
    owner = f'"{shorten(place[-1])}"' if place else "it"
    if isinstance(value, list):
        return f"; {owner} has {count_noun(len(value), 'element')}"
    if not isinstance(value, dict) or not value:
        return ""
    near = nearest_name(key, (*value, *_OPTIONAL_OBJECTS))
    return (
        f'; did you mean "{near}"?'
        if near
        else f"; {owner} has: {abbreviate_names(map(shorten, value), 12)}"
    )


def set_value(document: Any, pointer: str, value: Any) -> str:
    """Set a value in a JSON document.

    Only the last key, and "parameters" or "arguments" before it, may be new.

    Returns:
        The problem, or "".
    """
    keys = pointer_keys(pointer)
    target, depth = find_value(document, keys[:-1])
    if depth == len(keys) - 2 and keys[depth] in _OPTIONAL_OBJECTS and isinstance(target, dict):
        target, depth = target.setdefault(keys[depth], {}), depth + 1
    if depth < len(keys) - 1:
        return missing_value(document, pointer)
    if isinstance(target, dict):
        target[keys[-1]] = value
    elif isinstance(target, list) and keys[-1].isdigit() and int(keys[-1]) < len(target):
        target[int(keys[-1])] = value
    else:
        return missing_value(document, pointer)
    return ""


def value_path(document: Any, pointer: str) -> tuple[str | int, ...]:
    """Return the keys and indices that lead to an existing value, with indices of lists as integers."""
    path: list[str | int] = []
    for key in pointer_keys(pointer):
        path.append(int(key) if isinstance(document, list) else key)
        document = document[path[-1]]
    return tuple(path)
