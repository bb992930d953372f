"""Search for classes in the text of Modelica files, for messages with a place.

The models that a file declares are listed if a model is not found. An operator that the front end
refuses without a place is searched in the classes that a model uses, directly or indirectly.
"""

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path

from ....core.errors import abbreviate_names, nearest_name
from ..model.syntax_tree import SourceLocation

#: comments and strings, or the end of a class, or the beginning of one
_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"|\bend\s+(?P<end>\w+)\s*;|'
    r"(?P<prefix>\b(?:partial|redeclare|replaceable)\s+)*"
    r"\b(?P<kind>model|block|package|function|record|connector|class|type)\s+"
    r"(?P<name>[A-Za-z_]\w*)(?P<short>\s*=)?",
    re.DOTALL,
)
_MODELS = ("model", "block")
_MAX_LISTED = 6


def declared_models(text: str) -> list[str]:
    """Return the full names of the models and blocks of a Modelica text that can be instantiated.

    >>> declared_models("package P block A end A; package Q model C = P.A; end Q; end P;")
    ['P.A', 'P.Q.C']
    >>> declared_models("partial block B end B;")
    []
    """
    found = re.search(r"^\s*within\s+([\w.]+)\s*;", text, re.MULTILINE)
    enclosing = found[1].split(".") if found else []
    models = []
    for token in _TOKEN.finditer(text):
        if token["name"]:
            name = ".".join((*enclosing, token["name"]))
            if token["kind"] in _MODELS and not token["prefix"]:
                models.append(name)
            if not token["short"]:
                enclosing.append(token["name"])
        elif token["end"] and enclosing and token["end"] == enclosing[-1]:
            enclosing.pop()
    return models


def models_hint(name: str, path: Path) -> str:
    """Return a hint for the end of a message about a model that a file lacks.

    Its models, and the reference to the nearest one.

    Args:
        name: The missing model.
        path: The file. For a `package.mo` without models, those of the other files of its folder
            are listed.
    """
    models = dict(_models_of([path]))
    if not models and path.name == "package.mo":
        models = dict(_models_of(sorted(path.parent.glob("*.mo"))))
    if not models:
        return ""
    inside = any(model.startswith(f"{name}.") for model in models)
    near = (
        _same_class(name, models)
        or ("" if inside else nearest_name(name, models))
        or next(iter(models))
    )
    listed = f", but {abbreviate_names(models, _MAX_LISTED)}" if len(models) > 1 else ""
    return f"{listed}; write {_shown(models[near])}:{near}"


def _same_class(name: str, models: Iterable[str]) -> str:
    """Return the first model that has the name of another one without its packages.

    "" if there is none.
    """
    last = name.rpartition(".")[2].lower()
    return next((model for model in models if model.rpartition(".")[2].lower() == last), "")


def _models_of(files: Iterable[Path]) -> Iterator[tuple[str, Path]]:
    for file in files:
        text = file.read_text(encoding="utf-8", errors="replace")
        yield from ((model, file) for model in declared_models(text))


def _shown(file: Path) -> str:
    """Return the path of a file relative to the working directory if it is inside it."""
    return os.path.relpath(file) if file.is_relative_to(Path.cwd()) else str(file)


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
    """Return the first place of an operator in the classes that a text uses.

    The nearest classes come first.

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
