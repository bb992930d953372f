"""Values of a scenario that come from the caller: settings, and scenarios that are a dict.

A setting changes a value by its JSON pointer or by the name of a variable. Components of a dict may
be Python classes and objects.
"""

import inspect
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem
from ..core.text import acceptable_text, shorten, text_problem
from .component_sources import component_kinds
from .extension import expand_set_systems, inherited_component
from .file_paths import change_pointed, relocating
from .included_files import include_in_setting
from .json_document import (
    Document,
    JsonPath,
    find_value,
    json_path,
    parse_document,
    path_in_system,
    pointer_keys,
    set_value,
    value_path,
)


def apply_settings(
    document: Document, settings: Mapping[str, Any], folder: Path | None
) -> tuple[dict[str, Any], list[Problem]]:
    """Set the values of JSON pointers in a document.

    Sources of components first, since another kind replaces the component.

    Args:
        document: The expanded scenario, which is changed.
        settings: Values by JSON pointer or by the name of a variable.
        folder: The folder that paths in the values of JSON pointers start from; None: the working
            directory.

    Returns:
        The values of variables by name, and the problems of the settings.
    """
    problems: list[Problem] = []
    variables: dict[str, Any] = {}
    for name, value in sorted(settings.items(), key=lambda item: not _is_source(item[0])):
        if text := next(_text_problems([name, value]), ""):
            problems.append(Problem(text, f'setting "{shorten(acceptable_text(name))}"'))
        elif name.startswith("/"):
            try:
                keys = pointer_keys(name)
                value, files, documents = include_in_setting(
                    keys, move_objects(document, keys, value), folder or Path()
                )
                target = None if folder is None else document.file.parent
                value = change_pointed(name, value, relocating(folder or Path(), target))
            except InputError as error:
                problems += error.located(f'setting "{name}"')
                continue
            document.bases += tuple(files)
            if text := _set_value(document, name, value):
                problems.append(Problem(text, f'setting "{name}"'))
                continue
            path = value_path(document.value, name)
            document.set_documents |= {(*path, *inner): file for inner, file in documents.items()}
        else:
            variables[name] = value
    expand_set_systems(document)
    return variables, problems


def _is_source(name: str) -> bool:
    match path_in_system(pointer_keys(name)):
        case ["components", _, key]:
            return key in component_kinds((key,))
    return False


def _set_value(document: Document, pointer: str, value: Any) -> str:
    """Set a value in a document and note that it is a setting. Return the problem, or ""."""
    if _is_source(pointer) and value is not None:
        *place, name, source = pointer_keys(pointer)
        components, depth = find_value(document.value, place)
        if depth == len(place) and isinstance(components.get(name), dict):
            components[name] = inherited_component(components[name], {source: value})
    problem = set_value(document.value, pointer, value)
    if not problem:
        document.settings[value_path(document.value, pointer)] = pointer
    return problem


def _text_problems(value: Any) -> Iterator[str]:
    """Yield the problems of the texts in a JSON value."""
    if isinstance(value, str) and (problem := text_problem(value)):
        yield problem
    elif isinstance(value, dict | list):
        for part in value if isinstance(value, list) else (*value, *value.values()):
            yield from _text_problems(part)


def parse_settings(settings: Sequence[str]) -> dict[str, Any]:
    """Return the values of `NAME=value` texts by name. A value that is not JSON is taken as text.

    Raises:
        InputError: A text has no name or no "=", or a number is not finite.
    """
    parsed: dict[str, Any] = {}
    problems = []
    for text in settings:
        name, separator, value = text.partition("=")
        if not separator or not name:
            problems.append(Problem(f'expected NAME=value, found "{text}"'))
            continue
        parsed[name] = value
        try:
            with suppress(ValueError):  # it is a text
                parsed[name] = json.loads(value)
            if not _is_finite(parsed[name]):
                problems.append(Problem(f"expected finite numbers, found {shorten(value)}", name))
        except RecursionError:
            problems.append(Problem("nested too deeply", name))
    if problems:
        raise InputError(problems)
    return parsed


def _is_finite(value: Any) -> bool:
    """Return True if all numbers in a JSON value are finite."""
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)


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
    objects = _objects_in(scenario, ())
    text = json.dumps(_to_json(scenario, (), objects), indent=1)
    return parse_document(Document(Path.cwd() / DICT_FILE, text, objects=objects, is_dict=True))


def move_objects(document: Document, path: Sequence[str], value: Any) -> Any:
    """Move the Python classes and objects of a new value to the objects of a document.

    Args:
        document: The scenario in which the value will be set; an object of the component that it
            replaces is forgotten.
        path: Keys of the value.
        value: The value that a caller sets.

    Returns:
        The value with a text in place of the class or object. Values at other paths are unchanged.
    """
    system = value
    for key in reversed(path):
        system = {key: system}
    found = _objects_in(system, ())
    objects = {
        place: target
        for place, target in document.objects.items()
        if (*place, "python")[: len(path)] != tuple(path)
    }
    document.objects = {**objects, **found}
    return _to_json(value, tuple(path), found) if found else value


def _objects_in(system: Any, path: JsonPath) -> dict[JsonPath, Any]:
    """Return the Python classes and objects of a system by the paths of their components."""
    found: dict[JsonPath, Any] = {}
    for name, entry in _mapping(_mapping(system).get("components")).items():
        component, place = _mapping(entry), (*path, "components", name)
        if not isinstance(component.get("python", ""), str | None):
            found[place] = component["python"]
        found |= _objects_in(component.get("system"), (*place, "system"))
    return found


def describe_object(target: Any) -> str:
    """Return the text that stands for a Python class or object in the scenario of a result."""
    kind = target if inspect.isclass(target) or inspect.isroutine(target) else type(target)
    return f"{kind.__module__}:{kind.__qualname__}" + ("" if kind is target else " object")


def _mapping(value: Any) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


def _to_json(value: Any, path: JsonPath, objects: Mapping[JsonPath, Any]) -> Any:
    """Return a value with dicts, lists, texts, numbers and None only."""
    if path[-1:] == ("python",) and path[:-1] in objects:
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
