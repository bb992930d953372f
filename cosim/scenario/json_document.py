"""Strict JSON reader that keeps the line and column of every value, and JSON pointers (RFC 6901).

Duplicate keys, NaN, Infinity and numbers too large for a double are collected as problems with line
and column, and reading continues. Text that is not JSON at all raises InputError.
"""

from __future__ import annotations

import json
import math
import re
from bisect import bisect_right
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from ..core.errors import InputError, Problem, abbreviate_names, nearest_file, nearest_name
from ..core.paths import open_text
from ..core.text import acceptable_text, count_noun, shorten, text_problem

#: keys and indices from the root of a document to a value
JsonPath = tuple["str | int", ...]
T = TypeVar("T")
_DECODER = json.JSONDecoder()
_WHITESPACE = re.compile(r"[ \t\r\n]*")
_LITERAL = re.compile(r"-?Infinity|NaN|true|false|null|-?(?:0|[1-9]\d*)(?:\.\d+)?(?:[eE][-+]?\d+)?")
#: longest number that is read (characters); a longer one counts as infinite
_MAX_NUMBER_LENGTH = 1000
_IDENTIFIER = re.compile(r"[A-Za-z_]\w*")


@dataclass
class Document:
    """JSON value with the text offset of everything in it, and the problems found while reading."""

    file: Path
    text: str
    value: Any = None
    offsets: dict[JsonPath, int] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)
    #: paths of the values with these problems; they hold placeholders
    invalid_paths: list[JsonPath] = field(default_factory=list)
    #: where each value was written, if the value is merged from several documents
    origins: Mapping[JsonPath, Origin] = field(default_factory=dict)
    #: the other files from which the value is merged
    bases: tuple[Path, ...] = ()
    #: Python classes and objects by the paths of the components that they implement; from a dict or
    #: from settings
    objects: Mapping[JsonPath, Any] = field(default_factory=dict)
    #: paths of the values of other files that are removed
    removed: set[JsonPath] = field(default_factory=set)
    #: paths of the inline nested systems that extend a file
    complete_systems: Set[JsonPath] = frozenset()
    #: JSON pointers of the caller's settings by the paths of the values that they set
    settings: dict[JsonPath, str] = field(default_factory=dict)
    #: files that these settings name, by the paths of the values that are read from them
    set_documents: dict[JsonPath, Document] = field(default_factory=dict)
    #: the scenario is a dict and no file; `file` lies in the folder from which relative paths start
    is_dict: bool = False

    def where(self, path: JsonPath) -> str:
        """Return "file:line:column: $.json.path" of the deepest part of `path` that exists.

        A text such as "0" is taken as an index where the value is a list.
        File and JSON path are those in which the value was written. For a value that the caller
        has set it is its JSON pointer.
        """
        known = path = path if path in self.offsets else self._with_indices(path)
        if setting := next(
            (path[:n] for n in range(len(path), 0, -1) if path[:n] in self.settings), None
        ):
            text = f'setting "{self.settings[setting]}"'
            for n in range(len(path), len(setting) - 1, -1):
                if document := self.set_documents.get(path[:n]):
                    return f"{text}: {document.where(path[n:])}"
            return text if path == setting else f"{text}: {json_path(path)}"
        while known and known not in self.origins and known not in self.offsets:
            known = known[:-1]
        if (origin := self.origins.get(known)) and origin.document is not self:
            return origin.document.where((*origin.path, *path[len(known) :]))
        if self.is_dict:
            return f"scenario: {json_path(path)}"
        return f"{self.position(self.offsets.get(known, 0))}: {json_path(path)}"

    def _with_indices(self, path: Sequence[str | int]) -> JsonPath:
        """Return a path whose keys are numbers where the value is a list."""
        value, keys = self.value, []
        for key in path:
            if isinstance(value, list) and isinstance(key, str) and key.isdecimal():
                key = int(key)
            keys.append(key)
            try:
                value = value[key]
            except (LookupError, TypeError):
                value = None
        return tuple(keys)

    def refuse_objects(self, reason: str, classes: bool) -> None:
        """Raise InputError if components are Python objects, or (if `classes`) Python classes."""
        for path, target in self.objects.items():
            if classes or not callable(target):
                kind = "class or object" if classes else "object"
                where = self.where((*path, "python"))
                raise InputError(Problem(f"{reason}: found a Python {kind}", where))

    def part(self, path: JsonPath) -> Document:
        """Return the object at a path, an inline nested system, as a document of its own.

        Its problems are located in this document.
        """
        value = self.value
        for key in path:
            value = value[key]

        def below(paths: Iterable[JsonPath]) -> list[JsonPath]:
            return [each[len(path) :] for each in paths if each[: len(path)] == path]

        return Document(
            self.file,
            "",
            value,
            origins={(): Origin(self, path)},
            invalid_paths=below(self.invalid_paths),
            removed=set(below(self.removed)),
            objects={each: self.objects[*path, *each] for each in below(self.objects)},
            settings={each: self.settings[*path, *each] for each in below(self.settings)},
            set_documents={
                each: self.set_documents[*path, *each] for each in below(self.set_documents)
            },
            is_dict=self.is_dict,
        )

    @property
    def files(self) -> tuple[Path, ...]:
        """All files from which the value was read."""
        return self.bases if self.is_dict else (self.file, *self.bases)

    def origin(self, path: JsonPath) -> Origin:
        """Return where the value at an existing path was written."""
        return self.origins.get(path) or Origin(self, path)

    def position(self, offset: int) -> str:
        """Return "file:line:column" of an offset in the text."""
        line = bisect_right(self._lines, offset)
        return f"{self.file}:{line}:{offset - self._lines[line - 1] + 1}"

    @cached_property
    def _lines(self) -> list[int]:
        """Offset of the first character of each line."""
        return [0, *(match.end() for match in re.finditer("\n", self.text))]


class Origin(NamedTuple):
    """Place of a value in the document in which it was written."""

    document: Document
    path: JsonPath


def path_in_system(path: Sequence[T]) -> Sequence[T]:
    """Return the part of a path that lies in the innermost inline nested system.

    >>> path_in_system(("components", "uav", "system", "connections", 0))
    ('connections', 0)
    """
    while len(path) > 3 and (path[0], path[2]) == ("components", "system"):
        path = path[3:]
    return path


def json_path(path: Sequence[str | int]) -> str:
    """Return keys and indices as text, such as "$.components.uav" or "$.stages[0]"."""
    return "$" + "".join(_format_key(key) for key in path)


def _format_key(key: str | int) -> str:
    if isinstance(key, int):
        return f"[{key}]"
    return f".{shorten(key)}" if _IDENTIFIER.fullmatch(key) else f"[{json.dumps(shorten(key))}]"


def read_document(file: Path) -> Document:
    """Read a JSON file in UTF-8, with or without a byte order mark.

    Raises:
        InputError: The file cannot be read, is not UTF-8, or is not JSON.
    """
    try:
        with open_text(file, encoding="utf-8-sig") as opened:
            text = opened.read()
    except OSError as error:
        raise InputError(f'cannot read "{file}": {error.strerror}{nearest_file(file)}') from None
    except UnicodeDecodeError as error:
        raise InputError(
            f'"{file}" is not UTF-8 text: {error.reason} at byte {error.start}'
        ) from None
    parsed = _parse_file(file, text)
    return replace(
        parsed,
        value=copy_json(parsed.value),
        problems=[*parsed.problems],
        removed=set(),
        settings={},
        set_documents={},
    )


def copy_json(value: Any) -> Any:
    """Return a deep copy of a value of objects and lists.

    Five times faster than `copy.deepcopy`.
    """
    if isinstance(value, dict):
        return {key: copy_json(each) for key, each in value.items()}
    return [copy_json(each) for each in value] if isinstance(value, list) else value


@lru_cache(8)  # studies read the same files for each run
def _parse_file(file: Path, text: str) -> Document:
    return parse_document(Document(file, text))


def parse_document(document: Document) -> Document:
    """Read the value of a document from its text.

    Raises:
        InputError: The text is not JSON.
    """
    text = document.text
    parser = _JsonParser(document)
    document.value, end = parser.value(_skip_whitespace(text, 0), ())
    if _skip_whitespace(text, end) != len(text):
        raise parser.error(_skip_whitespace(text, end), "expected the end of the file")
    return document


def _skip_whitespace(text: str, offset: int) -> int:
    match = _WHITESPACE.match(text, offset)
    return match.end() if match else offset


class _JsonParser:
    """Recursive descent parser of JSON text.

    The methods for values return (value, offset of the first character after it).
    """

    def __init__(self, document: Document):
        self.document, self.text = document, document.text

    def error(self, offset: int, message: str) -> InputError:
        self.document.offsets.setdefault((), 0)
        return InputError(f"{self.document.position(offset)}: {message}")

    def value(self, offset: int, path: JsonPath) -> tuple[Any, int]:
        self.document.offsets[path] = offset
        if len(path) > 100:
            raise self.error(offset, "nested more than 100 levels deep")
        match self.text[offset : offset + 1]:
            case "{":
                return self.object(offset, path)
            case "[":
                return self.array(offset, path)
            case '"':
                text, end = self.string(offset)
                return self.clean(text, path), end
        return self.literal(offset, path)

    def object(self, offset: int, path: JsonPath) -> tuple[dict[str, Any], int]:
        result: dict[str, Any] = {}
        offset = _skip_whitespace(self.text, offset + 1)
        while self.text[offset : offset + 1] != "}":
            if result:
                offset = self.expect(offset, ",", "}")
            if self.text[offset : offset + 1] != '"':
                is_comment = self.text.startswith(("//", "/*"), offset)
                comment = "; JSON has no comments" if is_comment else ""
                raise self.error(offset, f'expected a key in double quotes or "}}"{comment}')
            begin = offset
            raw_key, offset = self.string(offset)
            key = acceptable_text(raw_key)
            if key != raw_key:
                self.document.offsets[(*path, key)] = begin
                self.clean(raw_key, (*path, key))
            offset = self.expect(_skip_whitespace(self.text, offset), ":")
            value, offset = self.value(offset, (*path, key))
            if key in result:
                self.document.offsets[(*path, key)] = begin
                self.problem((*path, key), "duplicate key")
            self.document.offsets[(*path, key)] = begin
            result[key] = value
            offset = _skip_whitespace(self.text, offset)
        return result, offset + 1

    def array(self, offset: int, path: JsonPath) -> tuple[list[Any], int]:
        result: list[Any] = []
        offset = _skip_whitespace(self.text, offset + 1)
        while self.text[offset : offset + 1] != "]":
            if result:
                offset = self.expect(offset, ",", "]")
            value, offset = self.value(offset, (*path, len(result)))
            result.append(value)
            offset = _skip_whitespace(self.text, offset)
        return result, offset + 1

    def expect(self, offset: int, *symbols: str) -> int:
        if self.text[offset : offset + 1] != symbols[0]:
            # end of the value before, after which a comma is probably missing
            end = len(self.text[:offset].rstrip())
            place = end if symbols[0] == "," and "\n" in self.text[end:offset] else offset
            raise self.error(place, f"expected {' or '.join(map(repr, symbols))}")
        return _skip_whitespace(self.text, offset + 1)

    def string(self, offset: int) -> tuple[str, int]:
        try:
            return _DECODER.raw_decode(self.text, offset)
        except json.JSONDecodeError as error:
            raise self.error(error.pos, error.msg) from None

    def clean(self, text: str, path: JsonPath) -> str:
        """Return the permitted part of a text.

        Add a problem of the value or key at `path` if another part exists.
        """
        if message := text_problem(text):
            self.problem(path, message)
        return acceptable_text(text)

    def literal(self, offset: int, path: JsonPath) -> tuple[Any, int]:
        match = _LITERAL.match(self.text, offset)
        if match is None:
            raise self.error(offset, "expected a JSON value")
        word = match.group()
        value = json.loads(word) if len(word) <= _MAX_NUMBER_LENGTH else math.inf
        if isinstance(value, float) and not math.isfinite(value):
            self.problem(path, f"{word:.40} is not allowed, expected a finite number")
            value = 0.0
        return value, match.end()

    def problem(self, path: JsonPath, message: str) -> None:
        self.document.problems.append(Problem(message, self.document.where(path)))
        self.document.invalid_paths.append(path)


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
    """Return the message about a JSON pointer to no value, with the keys of the deepest place.

    >>> missing_value({"environment": {"sea_state": 2, "seed": 1}}, "/environment/waves/direction")
    'the scenario has no "/environment/waves"; "environment" has: sea_state, seed'
    """
    keys = pointer_keys(pointer)
    value, depth = find_value(document, keys)
    text = f'the scenario has no "/{"/".join(keys[: depth + 1])}"'
    owner = f'"{shorten(keys[depth - 1])}"' if depth else "it"
    if isinstance(value, list):
        return f"{text}; {owner} has {count_noun(len(value), 'element')}"
    if not isinstance(value, dict) or not value:
        return text
    if near := nearest_name(keys[depth], (*value, *_OPTIONAL_OBJECTS)):
        return f'{text}; did you mean "{near}"?'
    return f"{text}; {owner} has: {abbreviate_names(map(shorten, value), 12)}"


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
    """Return the path of an existing value, with indices of lists as integers."""
    path: list[str | int] = []
    for key in pointer_keys(pointer):
        path.append(int(key) if isinstance(document, list) else key)
        document = document[path[-1]]
    return tuple(path)
