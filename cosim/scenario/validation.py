"""Validation of a JSON document against the schema, collecting all problems.

Invalid parts are reported and removed, so that the rest can be read.
"""

import json
import types
import typing
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from itertools import chain, count
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from ..core.errors import Problem, did_you_mean, nearest_name
from ..core.text import REPLACEMENT, count_noun
from .component_schema import component_model
from .component_sources import ComponentSource
from .json_document import Document, copy_json
from .schema import SystemSpec
from .schema_types import INVALID, PlacedError, hint_at_quotes

S = TypeVar("S", bound=SystemSpec)

#: values that replace missing or invalid required keys of the root
_PLACEHOLDERS: dict[str, Any] = {
    "name": "unnamed",
    "stop_time": 1,
    "step_size": 1,
    "components": {},
}
#: number of passes that remove only invalid parts; later ones remove whole keys of the root
_MAX_ATTEMPTS = 10
#: keys of the root with names that other parts refer to
_LISTS_OF_NAMES = ("record", "kpis", "ports")


def validate_document(document: Document, kind: type[S]) -> tuple[S, list[Problem], set[str]]:
    """Convert a document to a specification of the class `kind`.

    Parts that are invalid are reported and removed.

    Returns:
        The specification, the problems found, and the keys of the root that are invalid or missing.
    """
    value, problems = copy_json(document.value), list(document.problems)
    if not isinstance(value, dict):
        if () not in document.invalid_paths:
            problems.append(
                Problem(f"expected an object, found {_shorten_json(value)}", document.where(()))
            )
        required = {key: each for key, each in _PLACEHOLDERS.items() if key in kind.model_fields}
        return kind.model_validate(required), problems, set(kind.model_fields)
    result = _validate(kind, value)
    if isinstance(result, ValidationError):
        problems += schema_problems(kind, document, result)
    invalid_keys = _remove_invalid(kind, value, document.invalid_paths)
    if document.invalid_paths:
        result = _validate(kind, value)
    for attempt in count():  # errors of later passes are consequences of the removals
        if not isinstance(result, ValidationError):
            return result, problems, invalid_keys
        for detail in result.errors(include_url=False):
            path = _error_path(detail)
            if detail["type"] == "extra_forbidden":
                owner = _owner(value, path)
                if isinstance(owner, dict):  # else it has already been removed
                    owner.pop(path[-1], None)
                invalid_keys |= {key for key in _meant_keys(kind, path) if len(path) == 1}
            else:
                part = path[:-1] if detail["type"] == "missing" and len(path) > 1 else path
                invalid_keys |= _remove_invalid(
                    kind, value, [part if attempt < _MAX_ATTEMPTS else part[:1]]
                )
        result = _validate(kind, value)
    raise AssertionError


def _validate(kind: type[S], value: Any) -> S | ValidationError:
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        return error


def _remove_invalid(
    kind: type[BaseModel], value: Any, paths: Iterable[tuple[str | int, ...]]
) -> set[str]:
    """Remove the invalid parts at these paths.

    Return the keys of the root that are invalid or incomplete now.
    """
    keys = set()
    for path in paths:
        part = _smallest_meaningful_part(path)
        if len(part) == 1 or part[0] in _LISTS_OF_NAMES:
            keys.add(str(part[0]))
        _replace_invalid(kind, value, part)
    return keys


def _smallest_meaningful_part(path: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """Return the path of the part that must be removed with the value at `path`.

    `algorithm`, or the owner of an argument.
    """
    if path[0] == "algorithm":
        return path[:1]
    owner = 1 if path[0] == "scene" else 2
    return path[:owner] if path[owner : owner + 1] == ("arguments",) else path


def schema_problems(
    kind: type[BaseModel], document: Document, error: ValidationError
) -> list[Problem]:
    """Return a problem with its location in the document for every error that pydantic found.

    Errors that only follow from another one, or from a problem of the document, are left out.
    """
    details = [(_error_path(detail), detail) for detail in error.errors(include_url=False)]
    invalid = set(document.invalid_paths)
    above_invalid: set[tuple[str | int, ...]] = set()
    for path in invalid:
        above_invalid.update(path[:n] for n in range(len(path)))
    unknown_keys = {path: detail for path, detail in details if detail["type"] == "extra_forbidden"}
    illegal_names = {
        detail["input"] for _, detail in details if detail["loc"][::2] == ("components", "[key]")
    }

    def is_consequence(path: tuple[str | int, ...], detail: Any) -> bool:
        if any(path[:n] in invalid for n in range(len(path) + 1)):
            return True
        match detail["type"]:
            case "value_error":
                return path in above_invalid
            case "missing":
                misspelt = (other for other in (*unknown_keys, *invalid) if other[:-1] == path[:-1])
                return any(path[-1] in _meant_keys(kind, other) for other in misspelt)
            case "string_pattern_mismatch":
                return path[0] == "algorithm" and detail["input"] in illegal_names
        return False

    groups: dict[Any, list[tuple[tuple[str | int, ...], Any]]] = {}
    for path, detail in details:
        if not is_consequence(path, detail):
            groups.setdefault(_common_cause(path, detail), []).append((path, detail))
    return [_group_problem(kind, document, group) for group in groups.values()]


def _common_cause(path: tuple[str | int, ...], detail: Any) -> Any:
    """Return a key that is equal for problems with one cause.

    These are missing keys of one object, and elements of one list with the same wrong type.
    """
    is_shared = detail["type"] == "missing" or (
        detail["type"].endswith("_type") and isinstance(path[-1], int)
    )
    return (path[:-1] if is_shared else path, detail["type"])


def _group_problem(
    kind: type[BaseModel], document: Document, group: Sequence[tuple[tuple[str | int, ...], Any]]
) -> Problem:
    """Return one problem for errors with a common cause."""
    (path, detail), *others = group
    if others and detail["type"] == "missing":
        names = ", ".join(f'"{each[-1]}"' for each, _ in group)
        return Problem(f"the keys {names} are missing", document.where(path[:-1]))
    further = f", and {count_noun(len(others), 'more element')} likewise" if others else ""
    return Problem(_error_message(kind, path, detail) + further, document.where(path))


def _meant_keys(kind: type[BaseModel], path: Sequence[str | int]) -> list[str]:
    """Return the keys that the unknown key at `path` may mean.

    The most similar one, or all if it is unreadable.
    """
    key, known = str(path[-1]), _known_keys(kind, path[:-1])
    return known if REPLACEMENT in key else list(filter(None, [nearest_name(key, known)]))


def _error_path(detail: Any) -> tuple[str | int, ...]:
    place = getattr(detail.get("ctx", {}).get("error"), "path", ())
    return (*(key for key in detail["loc"] if key != "[key]"), *place)


def _error_message(kind: type[BaseModel], path: Sequence[str | int], detail: Any) -> str:
    found = _shorten_json(detail["input"])
    match detail["type"]:
        case "extra_forbidden":
            return f"unknown key{did_you_mean(str(path[-1]), _known_keys(kind, path[:-1]))}"
        case "missing":
            return f'the key "{path[-1]}" is missing'
        case "value_error":
            error = detail["ctx"]["error"]
            hint = hint_at_quotes(detail["input"], _is_number) if "number" in str(error) else ""
            return (
                str(error)
                if not path or isinstance(error, PlacedError)
                else f"{error}; found {found}{hint}"
            )
        case "dict_type" | "model_type":
            hint = ""
            if detail["input"] is None and len(path) == 2 and path[0] == "components":
                hint = '; a scenario that "extends" this one removes a component by null'
            return f"expected an object; found {found}{hint}"
        case "string_pattern_mismatch":
            characters = (
                'letters, digits, "_", ".", "-" and spaces'
                if tuple(path) == ("name",)
                else "letters, digits and underscores"
            )
            return f"expected a name of {characters}; found {found}"
    hint = (
        hint_at_quotes(detail["input"], _is_number)
        if detail["type"] in ("float_type", "int_type")
        else ""
    )
    return f"{detail['msg'].replace('Input should be', 'expected')}; found {found}{hint}"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _shorten_json(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _owner(value: Any, path: Sequence[str | int]) -> Any:
    """Return the object or list with the value at `path`; None if it has been removed."""
    for key in path[:-1]:
        if value is INVALID or not (
            key in value if isinstance(value, dict) else key in range(len(value))
        ):
            return None
        value = value[key]
    return value


def _replace_invalid(kind: Any, value: Any, path: Sequence[str | int]) -> None:
    """Remove the element at `path`.

    Required keys of the root and elements of lists get a placeholder.
    """
    owner, last = _owner(value, path), path[-1]
    if owner is value and last in _PLACEHOLDERS:
        owner[last] = copy_json(_PLACEHOLDERS[str(last)])
    elif isinstance(owner, dict):
        owner.pop(last, None)
    elif isinstance(owner, list) and last in range(len(owner)):
        if _model_type(reduce(_child_type, path, kind)):
            owner[int(last)] = INVALID
        else:
            del owner[int(last)]


def _known_keys(kind: Any, path: Sequence[str | int]) -> list[str]:
    """Return the keys that the schema allows at a path."""
    model = _model_type(reduce(_child_type, path, kind))
    return [field.alias or name for name, field in _fields(model).items()] if model else []


def _fields(model: type[BaseModel]) -> Mapping[str, FieldInfo]:
    """Return the fields of a model; those of components depend on the kind of their source."""
    return (component_model() if model is ComponentSource else model).model_fields


def _child_type(kind: Any, key: str | int) -> Any:
    """Return the annotation of the value at a key or index of a value of type `kind`.

    None if it is unknown.
    """
    if model := _model_type(kind):
        return next((f.annotation for n, f in _fields(model).items() if key in (n, f.alias)), None)
    for option in _union_members(kind):
        if typing.get_origin(option) in (dict, list):
            return typing.get_args(option)[-1]
    return None


def _model_type(kind: Any) -> type[BaseModel] | None:
    """Return the pydantic model in an annotation, if there is one."""
    return next(
        (o for o in _union_members(kind) if isinstance(o, type) and issubclass(o, BaseModel)), None
    )


def _union_members(kind: Any) -> list[Any]:
    """Return the members of a union without `Annotated`."""
    if typing.get_origin(kind) is typing.Annotated:
        return _union_members(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return list(chain.from_iterable(map(_union_members, typing.get_args(kind))))
    return [kind]
