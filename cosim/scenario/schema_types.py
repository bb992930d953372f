"""Types of values in scenario files, and the base class of their data model."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Annotated, Any, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    WithJsonSchema,
    model_validator,
)

from ..core.time_grid import MAX_TIME, exact_fraction

S = TypeVar("S")
#: returns the new text of a path
PathChange = Callable[[str], str]

_UNSIGNED_TIME = r"[0-9]{1,400}/0{0,399}[1-9][0-9]{0,399}$"
#: text of a time: a fraction; as regular expression of Python and of JSON Schema
_TIME_PATTERN = rf"^[-+]?{_UNSIGNED_TIME}"
_POSITIVE_TIME_PATTERN = rf"^\+?(?=0*[1-9]){_UNSIGNED_TIME}"
_EXPECTED_TIME = 'expected seconds as a number or as a fraction in text such as "1/60"'


class PlacedError(ValueError):
    """Violation that a validator of a whole object finds in a part of it.

    Attributes:
        path: Keys and indices of the part, from the validated object.
    """

    def __init__(self, message: str, *path: str | int) -> None:
        super().__init__(message)
        self.path = path


def _parse_time(value: Any) -> Fraction:
    is_text = isinstance(value, str) and re.fullmatch(_TIME_PATTERN, value)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    with suppress(ValueError, ZeroDivisionError):
        if is_text or is_number:
            return exact_fraction(value)
    raise ValueError(_EXPECTED_TIME)


def hint_at_quotes(value: Any, accepts: Callable[[Any], bool]) -> str:
    """Return a hint at a value in quotes that `accepts` accepts without them, else ""."""
    try:
        content = json.loads(value) if isinstance(value, str) else None
    except ValueError:
        return ""
    return (
        f"; write {value.strip()} without quotes"
        if content is not None and accepts(content)
        else ""
    )


def _require(accepts: Callable[[Any], bool], expected: str) -> Callable[[Any], Any]:
    """Return a validator that refuses what `accepts` does not accept."""

    def check(value: Any) -> Any:
        if not accepts(value):
            raise ValueError(f"expected {expected}")
        return value

    return check


def _check_value(value: Any) -> Any:
    values: list[Any] = []
    for row in value if isinstance(value, list) else [value]:
        values += row if isinstance(row, list) and row else [row]
    if not values or not all(isinstance(v, bool | int | float | str) for v in values):
        raise ValueError("expected a number, true, false, a text, or a list of these")
    return value


def _as_integer(value: Any) -> Any:
    """Return an integral float such as 1.0 as integer, which it is in JSON Schema."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _as_list(value: Any) -> Any:
    return [value] if isinstance(value, str) else value


def _check_gain(value: Any) -> Any:
    gains = value if isinstance(value, list) else [value]
    if not all(isinstance(gain, int | float) and not isinstance(gain, bool) for gain in gains):
        raise ValueError("expected a number or a list of numbers")
    return value


def _time_schema(pattern: str, **limits: float) -> WithJsonSchema:
    """Return the JSON Schema of a time: a number within limits, or a text with a pattern."""
    number = {"type": "number", **limits, "maximum": MAX_TIME}
    return WithJsonSchema({"anyOf": [number, {"type": "string", "pattern": pattern}]})


Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z_][A-Za-z0-9_]*$")]
Seconds = Annotated[
    Fraction,
    BeforeValidator(_parse_time),
    _time_schema(_TIME_PATTERN, minimum=-MAX_TIME),
]
Period = Annotated[
    Seconds,
    AfterValidator(_require(lambda value: value > 0, "a positive number of seconds")),
    _time_schema(_POSITIVE_TIME_PATTERN, exclusiveMinimum=0),
]
Duration = Annotated[
    Seconds,
    AfterValidator(_require(lambda value: value >= 0, "0 s or more")),
    _time_schema(rf"^\+?{_UNSIGNED_TIME}", minimum=0),
]
Gain = Annotated[
    float | list[float],
    BeforeValidator(_check_gain),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "array", "items": {"type": "number"}}]}),
]
Integer = Annotated[int, BeforeValidator(_as_integer)]
BoolOrNumber = Annotated[
    bool | int | float,
    BeforeValidator(
        _require(lambda value: isinstance(value, bool | int | float), "a number, true or false")
    ),
    WithJsonSchema({"type": ["number", "boolean"]}),
]


def _list_of(schemas: list[dict[str, Any]]) -> dict[str, Any]:
    return {"type": "array", "items": {"anyOf": schemas}, "minItems": 1}


_SCALAR_SCHEMAS: list[dict[str, Any]] = [{"type": kind} for kind in ("number", "boolean", "string")]
Value = Annotated[
    Any,
    BeforeValidator(_check_value),
    WithJsonSchema(
        {"anyOf": [*_SCALAR_SCHEMAS, _list_of([*_SCALAR_SCHEMAS, _list_of(_SCALAR_SCHEMAS)])]}
    ),
]
AutoOrBool = Annotated[
    Literal["auto"] | bool,
    BeforeValidator(
        _require(lambda value: value == "auto" or isinstance(value, bool), '"auto", true or false')
    ),
    WithJsonSchema({"enum": ["auto", True, False]}),
]
NameList = Annotated[
    list[str],
    BeforeValidator(_as_list),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}),
]


@dataclass(frozen=True)
class HoldsPaths:
    """Mark of a key whose value holds paths of files.

    Attributes:
        change: Returns the JSON value of the key with every path changed.
    """

    change: Callable[[Any, PathChange], Any]


def change_path(value: Any, change: PathChange) -> Any:
    """Return a changed path; other values stay as they are."""
    return change(value) if isinstance(value, str) else value


def _change_list(value: Any, change: PathChange) -> Any:
    is_list = isinstance(value, list) and all(isinstance(each, str) for each in value)
    return list(map(change, value)) if is_list else value


def change_reference(reference: Any, change: PathChange) -> Any:
    """Return a reference "file.py:name" or "file.mo:Model" with a changed path.

    Modules stay as they are.
    """
    if not isinstance(reference, str):
        return reference
    file, separator, name = reference.rpartition(":")
    return f"{change(file)}{separator}{name}" if file.endswith((".py", ".mo")) else reference


FilePath = Annotated[str, HoldsPaths(change_path)]
FolderPaths = Annotated[list[str], HoldsPaths(_change_list)]
FileReference = Annotated[str, HoldsPaths(change_reference)]


class InvalidElement:
    """Placeholder of an invalid list element, which keeps the indices of the elements after it."""


INVALID: Any = InvalidElement()


def key(description: str, example: Any, *, unit: str = "", **rules: Any) -> Any:
    """Return the field of a key with its documentation in the JSON Schema.

    Args:
        description: Meaning of the value.
        example: A valid value.
        unit: Unit of the value.
        **rules: Default, alias and limits, as of `pydantic.Field`.
    """
    return Field(
        description=description,
        examples=[example],
        json_schema_extra={"unit": unit} if unit else None,
        **rules,
    )


class Spec(BaseModel):
    """Base of all parts of a scenario; unknown keys and implicit type conversions are errors."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        arbitrary_types_allowed=True,
        defer_build=True,  # a run builds only the models that it validates
    )

    @property
    def paths(self) -> list[str]:
        """Paths of the files that this part names, as they are written in the scenario."""
        found: list[str] = []

        def note(path: str) -> str:
            found.append(path)
            return path

        for name, mark in path_keys(type(self)).items():
            mark.change(getattr(self, name), note)
        return found

    @model_validator(mode="wrap")
    @classmethod
    def _pass_invalid(cls, value: Any, handler: Any) -> Any:
        return value if value is INVALID else handler(value)


@cache
def path_keys(model: type[Spec]) -> Mapping[str, HoldsPaths]:
    """Return the keys of a part of a scenario that hold paths."""
    marks: dict[str, HoldsPaths] = {}
    for name, field in model.model_fields.items():
        for mark in field.metadata:
            if isinstance(mark, HoldsPaths):
                marks[name] = mark
    return marks


def accepted(specs: Iterable[S]) -> Iterator[tuple[int, S]]:
    """Yield (index, specification) of the valid elements of a list."""
    return ((i, spec) for i, spec in enumerate(specs) if spec is not INVALID)


def schema_of(model: type[BaseModel], *further: type[BaseModel]) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of a model.

    Entries in the order of the code, names only as their patterns allow.

    Args:
        model: The model.
        *further: Models that {"ref": name of the model} in the schema refers to.
    """
    from pydantic.json_schema import GenerateJsonSchema, models_json_schema

    class InOrder(GenerateJsonSchema):
        def sort(self, value: Any, parent_key: str | None = None) -> Any:  # noqa: ARG002
            return value

    models = dict.fromkeys((model, *further))
    _, schema = models_json_schema(
        [(each, "validation") for each in models], by_alias=True, schema_generator=InOrder
    )
    _complete(schema)
    definitions = schema["$defs"]
    root = definitions[model.__name__]
    if model not in further:
        del definitions[model.__name__]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "$defs": definitions,
        **root,
    }


def _complete(schema: Any) -> None:
    """Refuse other names than a pattern allows, and complete the references to further models."""
    if isinstance(schema, dict):
        if "patternProperties" in schema:
            schema["additionalProperties"] = False
        if isinstance(name := schema.get("ref"), str):
            schema["$ref"] = f"#/$defs/{name}"
            del schema["ref"]
        for value in schema.values():
            _complete(value)
    elif isinstance(schema, list):
        for value in schema:
            _complete(value)
