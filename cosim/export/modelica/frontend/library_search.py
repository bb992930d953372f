"""Search for an operator in the classes of libraries that a model uses, directly or indirectly."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

from ..model.syntax_tree import SourceLocation

#: largest number of classes that are searched
MAX_CLASSES = 400

_CLASS = r"^[^/\n]*\b(?:model|block|class|function|package|record|connector|type)\s+{}\b"
_HIDDEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"', re.DOTALL)
_REFERENCE = re.compile(r"(?<![\w.])[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+")


def find_class(folder: Path, names: list[str]) -> tuple[SourceLocation, bool] | None:
    """Return the declaration of a class, and whether it is complete.

    Args:
        folder: The folder of the package that contains the class.
        names: Names of the nested classes. The last ones may be members of a class; then the class
            is not complete.
    """
    while names and (folder / names[0] / "package.mo").is_file():
        folder, names = folder / names[0], names[1:]
    file = (
        folder / f"{names[0]}.mo"
        if names and (folder / f"{names[0]}.mo").is_file()
        else folder / "package.mo"
    )
    text, position, found = _code(file), -1, 0
    for name in names:
        declaration = re.compile(_CLASS.format(re.escape(name)), re.MULTILINE).search(
            text, max(position, 0)
        )
        if declaration is None:
            break
        position, found = declaration.end(), found + 1
    return (
        (SourceLocation(file, text.count("\n", 0, position) + 1), found == len(names))
        if position >= 0
        else None
    )


def find_operator(word: str, code: str, packages: Mapping[str, Path]) -> SourceLocation | None:
    """Return the first place of an operator in the classes that a text uses, the nearest classes first.

    Args:
        word: The operator.
        code: Text of the model.
        packages: Folder of each library by its name.
    """
    pending, seen = [("", code)], {""}
    pattern = re.compile(rf"\b{re.escape(word)}\b")
    while pending and len(seen) < MAX_CLASSES:
        owner, text = pending.pop(0)
        for name in _references(owner, _HIDDEN.sub(" ", text), packages):
            place = (
                None
                if name in seen
                else find_class(packages[name.partition(".")[0]], name.split(".")[1:])
            )
            seen.add(name)
            if place and place[1]:
                body = _body(place[0], name.rpartition(".")[2])
                if match := pattern.search(body):
                    return SourceLocation(
                        place[0].path, place[0].line + body.count("\n", 0, match.start())
                    )
                pending.append((name, body))
    return None


def _references(owner: str, code: str, packages: Mapping[str, Path]) -> Iterator[str]:
    """Yield the full names of classes that the code of a class may refer to."""
    enclosing = owner.split(".")[:-1]
    for reference in dict.fromkeys(_REFERENCE.findall(code)):
        if reference.partition(".")[0] in packages:
            yield reference
        else:
            yield from (".".join((*enclosing[:k], reference)) for k in range(len(enclosing), 0, -1))


def _body(place: SourceLocation, name: str) -> str:
    """Return the code of a class from the line of its declaration to its end."""
    text = _code(place.path).split("\n", place.line - 1)[-1]
    end = re.search(rf"\bend\s+{re.escape(name)}\s*;", text)
    return text[: end.end()] if end else text.partition("\n")[0]


@cache
def _code(file: Path) -> str:
    """Return the text of a file without comments and strings; the lines are unchanged."""
    text = file.read_text(encoding="utf-8", errors="replace")
    return _HIDDEN.sub(lambda hidden: re.sub(r"[^\n]", " ", hidden[0]), text)
