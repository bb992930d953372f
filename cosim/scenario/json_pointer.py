"""JSON pointers (RFC 6901) into scenario files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


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


def set_value(document: Any, pointer: str, value: Any) -> str:
    """Set a value in a JSON document; only the last key of the pointer may be new. Return the problem, or ""."""
    keys = pointer_keys(pointer)
    target, depth = find_value(document, keys[:-1])
    if depth < len(keys) - 1:
        return f'the scenario has no "/{"/".join(keys[: depth + 1])}"'
    if isinstance(target, dict):
        target[keys[-1]] = value
    elif isinstance(target, list) and keys[-1].isdigit() and int(keys[-1]) < len(target):
        target[int(keys[-1])] = value
    else:
        return f'the scenario has no "{pointer}"'
    return ""
