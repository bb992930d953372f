"""Validation of a JSON document against the schema, collecting all problems.

Invalid parts are reported and removed, so that the rest can be read.
"""

from __future__ import annotations

import copy
import json
import types
import typing
from collections.abc import Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

from ..core.errors import Problem, did_you_mean
from .json_document import Document
from .schema import SystemSpec
from .schema_types import INVALID

S = TypeVar("S", bound=SystemSpec)

#: values that replace missing or invalid required keys of the root
_PLACEHOLDERS: dict[str, Any] = {"name": "unnamed", "stop_time": 1, "step_size": 1, "components": {}}


class Validated(NamedTuple, Generic[S]):
    """Specification without the invalid parts of its document, and the problems found."""

    spec: S
    problems: list[Problem]
    #: keys of the root that are invalid or missing
    invalid_keys: set[str]


def validate_document(document: Document, kind: type[S]) -> Validated[S]:
    """Convert a document to a specification of the class `kind`; parts that are invalid are reported and removed."""
    value = copy.deepcopy(document.value)
    problems = list(document.problems)
    invalid_keys: set[str] = set()
    if not isinstance(value, dict):
        problems.append(Problem(f"expected an object, found {_shorten_json(value)}", document.where(())))
        value = {}
    is_first_pass = True
    while True:
        try:
            return Validated(kind.model_validate(value), problems, invalid_keys)
        except ValidationError as error:
            if is_first_pass:  # errors of later passes are consequences of the removals
                problems += schema_problems(kind, document, error)
            for detail in error.errors(include_url=False):
                path = _error_path(detail)
                invalid_keys |= {str(key) for key in path[:1] if len(path) == 1}
                if detail["type"] == "extra_forbidden":
                    _remove_key(value, path)
                else:
                    _replace_invalid(kind, value, path[:-1] if detail["type"] == "missing" and len(path) > 1 else path)
            is_first_pass = False


def schema_problems(kind: type[BaseModel], document: Document, error: ValidationError) -> list[Problem]:
    """Return a problem with its location in the document for every error that pydantic found."""
    details = [(_error_path(detail), detail) for detail in error.errors(include_url=False)]
    return [Problem(_error_message(kind, path, detail), document.where(path)) for path, detail in details]


def _error_path(detail: Any) -> tuple[str | int, ...]:
    return tuple(key for key in detail["loc"] if key != "[key]")


def _error_message(kind: type[BaseModel], path: Sequence[str | int], detail: Any) -> str:
    found = _shorten_json(detail["input"])
    match detail["type"]:
        case "extra_forbidden":
            return f"unknown key{did_you_mean(str(path[-1]), _known_keys(kind, path[:-1]))}"
        case "missing":
            return f'the key "{path[-1]}" is missing'
        case "value_error":
            return f"{detail['ctx']['error']}; found {found}"
        case "string_pattern_mismatch":
            return f"expected a name of letters, digits and underscores; found {found}"
    return f"{detail['msg'].replace('Input should be', 'expected')}; found {found}"


def _shorten_json(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _remove_key(value: Any, path: Sequence[str | int]) -> None:
    """Remove an unknown key, unless the object that contained it has already been removed."""
    for key in path[:-1]:
        if value is INVALID or not (key in value if isinstance(value, dict) else key in range(len(value))):
            return
        value = value[key]
    if isinstance(value, dict):
        value.pop(path[-1], None)


def _replace_invalid(kind: Any, value: Any, path: Sequence[str | int]) -> None:
    """Remove the element at `path`; required keys of the root and elements of lists get a placeholder."""
    root = value
    for key in path[:-1]:
        if value is INVALID or not (key in value if isinstance(value, dict) else key in range(len(value))):
            return
        value, kind = value[key], _child_type(kind, key)
    last = path[-1]
    if value is root and last in _PLACEHOLDERS:
        value[last] = copy.deepcopy(_PLACEHOLDERS[str(last)])
    elif isinstance(value, dict):
        value.pop(last, None)
    elif isinstance(value, list) and last in range(len(value)):
        if _model_type(_child_type(kind, last)):
            value[int(last)] = INVALID
        else:
            del value[int(last)]


def _known_keys(kind: Any, path: Sequence[str | int]) -> list[str]:
    """Return the keys that the schema allows at a path."""
    for key in path:
        kind = _child_type(kind, key)
    kind = _model_type(kind)
    return [field.alias or name for name, field in kind.model_fields.items()] if kind else []


def _child_type(kind: Any, key: str | int) -> Any:
    """Return the annotation of what a key or index of a value of type `kind` holds, or None if it is unknown."""
    if model := _model_type(kind):
        return next((f.annotation for n, f in model.model_fields.items() if key in (n, f.alias)), None)
    for option in _union_members(kind):
        if typing.get_origin(option) in (dict, list):
            return typing.get_args(option)[-1]
    return None


def _model_type(kind: Any) -> type[BaseModel] | None:
    """Return the pydantic model in an annotation, if there is one."""
    return next((o for o in _union_members(kind) if isinstance(o, type) and issubclass(o, BaseModel)), None)


def _union_members(kind: Any) -> list[Any]:
    """Return the members of a union without `Annotated`."""
    if typing.get_origin(kind) is typing.Annotated:
        return _union_members(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return [option for member in typing.get_args(kind) for option in _union_members(member)]
    return [kind]
