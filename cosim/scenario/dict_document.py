"""Scenarios that are given as a dict, in which components may be Python classes and objects."""

from __future__ import annotations

import inspect
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem
from ..core.text import shorten
from .json_document import Document, JsonPath, json_path, parse_document

#: name of the file that stands for a dict, in the working directory
DICT_FILE = "(dict)"
#: levels of lists and dicts at which a dict that contains itself is noticed
_MAX_LEVELS = 100


def document_of_dict(scenario: Mapping[str, Any]) -> Document:
    """Return the document of a scenario that is given as a dict.

    Relative paths start from the working directory.

    Raises:
        InputError: The dict contains values that JSON cannot express.
    """
    objects = _objects_of(_mapping(scenario).get("components"))
    text = json.dumps(_to_json(scenario, (), objects), indent=1)
    return parse_document(Document(Path.cwd() / DICT_FILE, text, objects=objects, is_dict=True))


def move_objects(document: Document, path: Sequence[str], value: Any) -> Any:
    """Move the Python class or object in the new value of a component, or of its key "python", to the objects of a document.

    Args:
        document: The scenario in which the value will be set; an object of the component that it replaces is forgotten.
        path: Keys of the value.
        value: The value that a caller sets.

    Returns:
        The value with a text in place of the class or object. Values at other paths are unchanged.
    """
    if (
        path[0] != "components"
        or len(path) not in (2, 3)
        or (len(path) == 3 and path[2] != "python")
    ):
        return value
    found = _objects_of({path[1]: value if len(path) == 2 else {"python": value}})
    document.objects = {
        name: target for name, target in document.objects.items() if name != path[1]
    } | found
    return _to_json(value, tuple(path), found) if found else value


def _objects_of(components: Any) -> dict[str, Any]:
    """Return the Python classes and objects by the names of their components."""
    return {
        name: spec["python"]
        for name, spec in _mapping(components).items()
        if isinstance(spec, Mapping) and not isinstance(spec.get("python", ""), str | None)
    }


def describe_object(target: Any) -> str:
    """Return the text that stands for a Python class or object in the scenario of a result."""
    kind = target if inspect.isclass(target) or inspect.isroutine(target) else type(target)
    return f"{kind.__module__}:{kind.__qualname__}" + ("" if kind is target else " object")


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _to_json(value: Any, path: JsonPath, objects: Mapping[str, Any]) -> Any:
    """Return a value with dicts, lists, texts, numbers and None only."""
    if len(path) == 3 and path[0] == "components" and path[2] == "python" and path[1] in objects:
        return describe_object(value)
    if value is None or isinstance(value, bool | str | int | float):
        return value
    if len(path) > _MAX_LEVELS:
        raise _refusal(path, "nested more than 100 levels deep")
    if isinstance(value, Mapping):
        if wrong := [key for key in value if not isinstance(key, str)]:
            raise _refusal(path, f"expected texts as keys, found {shorten(repr(wrong[0]))}")
        return {key: _to_json(each, (*path, key), objects) for key, each in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, bytes | bytearray):
        return [_to_json(each, (*path, i), objects) for i, each in enumerate(value)]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):  # of NumPy
        return _to_json(value.tolist(), path, objects)
    raise _refusal(
        path, f"expected a value as in JSON, found {shorten(repr(value))} ({type(value).__name__})"
    )


def _refusal(path: JsonPath, text: str) -> InputError:
    return InputError(Problem(text, f"scenario: {json_path(path)}"))
