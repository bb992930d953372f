"""Reading the files of `cosim sweep` and `cosim tune`."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Generic, TypeVar

from pydantic import ValidationError

from .. import paths, resources
from ..errors import InputError, Problem, did_you_mean
from ..scenario.document import Document, read_document
from ..scenario.tree import find
from ..scenario.validate import refusals
from .schema import StudySpec

S = TypeVar("S", bound=StudySpec)

_FOLDER = Path("scenarios") / "sweeps"


@dataclass(frozen=True)
class Read(Generic[S]):
    """A sweep or tuning file and what it says."""

    spec: S
    document: Document

    @property
    def scenario(self) -> Path:
        """The scenario's file."""
        near = self.document.file.parent / self.spec.scenario
        return near if paths.is_file(near) else find(self.spec.scenario)

    def located(self, problems: Iterable[Problem]) -> list[Problem]:
        """Problems with a run's settings, at the place in this file that makes the setting."""
        return list(dict.fromkeys(replace(problem, where=self._place(problem.where)) for problem in problems))

    def _place(self, where: str) -> str:
        _, quote, name = where.partition('setting "')
        if not quote:
            return where
        path = next((path for path, value in self._strings() if name.rstrip('"') in (path[-1], value)), None)
        return self.document.where(path) if path else where

    def _strings(self) -> Iterable[tuple[tuple[str | int, ...], object]]:
        """Paths in the file that name settings: keys of objects, and texts of "set"."""
        for path in sorted(self.document.offsets, key=lambda path: self.document.offsets[path]):
            if path and ("set" in path or "settings" in path or "levels" in path or "cases" in path):
                yield path, _at(self.document.value, path)


def _at(value: object, path: tuple[str | int, ...]) -> object:
    for key in path:
        value = value[key]  # type: ignore[index]
    return value


def read(file: str | Path, kind: type[S]) -> Read[S]:
    """A sweep or tuning from a file, or a shipped one by its name. Raises InputError with everything that is wrong."""
    document = read_document(_find(file))
    try:
        spec = kind.model_validate(document.value)
    except ValidationError as error:
        raise InputError([*document.problems, *refusals(kind, document, error)]) from None
    if document.problems:
        raise InputError(document.problems)
    found = Read(spec, document)
    try:
        found.scenario  # noqa: B018
    except InputError as error:
        raise InputError([replace(problem, where=document.where(("scenario",))) for problem in error.problems]) from None
    return found


def _find(file: str | Path) -> Path:
    path = Path(file)
    if path.suffix == ".json" or paths.is_file(path):
        return path
    names = sorted(each.stem for each in (resources.root() / _FOLDER).glob("*.json"))
    if str(file) not in names:
        raise InputError(f'no file and no shipped sweep "{file}"{did_you_mean(str(file), names)}')
    return resources.root() / _FOLDER / f"{file}.json"
