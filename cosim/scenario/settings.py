"""Settings: values of a scenario that the caller changes, by JSON pointer or by the name of a variable."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem
from ..core.text import acceptable_text, shorten, text_problem
from . import json_pointer
from .component_schema import SOURCES
from .dict_document import move_objects
from .extension import inherited_component
from .file_paths import change_pointed, relocating
from .included_files import include_in_setting
from .json_document import Document


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
            change = (
                relocating(Path(), None)
                if folder is None
                else relocating(folder, document.file.parent)
            )
            try:
                keys = json_pointer.pointer_keys(name)
                value, files, documents = include_in_setting(
                    keys, move_objects(document, keys, value), folder or Path()
                )
                value = change_pointed(name, value, change)
            except InputError as error:
                problems += [
                    Problem(problem.message, problem.where or f'setting "{name}"')
                    for problem in error.problems
                ]
                continue
            document.bases += tuple(files)
            if text := _set_value(document, name, value):
                problems.append(Problem(text, f'setting "{name}"'))
                continue
            path = json_pointer.value_path(document.value, name)
            document.set_documents |= {(*path, *inner): file for inner, file in documents.items()}
        else:
            variables[name] = value
    return variables, problems


def _is_source(name: str) -> bool:
    keys = json_pointer.pointer_keys(name)
    return len(keys) == 3 and keys[0] == "components" and keys[2] in SOURCES


def _set_value(document: Document, pointer: str, value: Any) -> str:
    """Set a value in a document and note that it is a setting. Return the problem, or ""."""
    if _is_source(pointer) and value is not None:
        components, name, source = json_pointer.pointer_keys(pointer)
        component, depth = json_pointer.find_value(document.value, (components, name))
        if depth == 2 and isinstance(component, dict):
            document.value[components][name] = inherited_component(component, source)
    problem = json_pointer.set_value(document.value, pointer, value)
    if not problem:
        document.settings[json_pointer.value_path(document.value, pointer)] = pointer
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
        try:
            parsed[name] = _parse_json_or_text(value)
            if not _is_finite(parsed[name]):
                problems.append(Problem(f"expected finite numbers, found {shorten(value)}", name))
        except RecursionError:
            problems.append(Problem("nested too deeply", name))
    if problems:
        raise InputError(problems)
    return parsed


def _parse_json_or_text(text: str) -> Any:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _is_finite(value: Any) -> bool:
    """Return True if all numbers in a JSON value are finite."""
    if isinstance(value, dict | list):
        return all(map(_is_finite, value.values() if isinstance(value, dict) else value))
    return not isinstance(value, float) or math.isfinite(value)
