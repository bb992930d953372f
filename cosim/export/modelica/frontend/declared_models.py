"""Search for the models that a Modelica file declares, for messages about a model that it does not contain."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

from ....core.errors import abbreviate_names, nearest_name

#: comments and strings, or the end of a class, or the beginning of one
_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"|\bend\s+(?P<end>\w+)\s*;|'
    r"(?P<prefix>\b(?:partial|redeclare|replaceable)\s+)*"
    r"\b(?P<kind>model|block|package|function|record|connector|class|type)\s+(?P<name>[A-Za-z_]\w*)(?P<short>\s*=)?",
    re.DOTALL,
)
_MODELS = ("model", "block")
_MAX_LISTED = 6


def declared_models(text: str) -> list[str]:
    """Return the full names of the models and blocks of a Modelica text that can be instantiated.

    >>> declared_models("package P block A end A; partial block B end B; package Q model C = P.A; end Q; end P;")
    ['P.A', 'P.Q.C']
    """
    enclosing = _within(text)
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


def _within(text: str) -> list[str]:
    found = re.search(r"^\s*within\s+([\w.]+)\s*;", text, re.MULTILINE)
    return found[1].split(".") if found else []


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
    return (
        (model, file)
        for file in files
        for model in declared_models(file.read_text(encoding="utf-8", errors="replace"))
    )


def _shown(file: Path) -> str:
    """Return the path of a file relative to the working directory if it is inside it."""
    return os.path.relpath(file) if file.is_relative_to(Path.cwd()) else str(file)
