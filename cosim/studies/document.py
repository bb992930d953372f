"""Reader of sweep and tuning files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import ValidationError

from ..core import paths, resources
from ..core.errors import InputError, Problem, did_you_mean, nearest_file
from ..core.size_limits import MAX_RUNS, require_at_most
from ..scenario import load_scenario
from ..scenario.file_paths import find_scenario
from ..scenario.json_document import Document, json_path, pointer_keys, read_document
from ..scenario.settings import document_of_dict
from ..scenario.validation import schema_problems
from .schema import StudySpec

S = TypeVar("S", bound=StudySpec)

_SHIPPED_FOLDER = Path("scenarios") / "sweeps"


@dataclass(frozen=True)
class StudyFile(Generic[S]):
    """Sweep or tuning file: its validated content and its JSON document with positions."""

    spec: S
    document: Document

    @cached_property
    def scenario(self) -> Path:
        """Path of the scenario's file."""
        near = self.document.file.parent / self.spec.scenario
        return near if paths.is_file(near) else find_scenario(self.spec.scenario)

    def locate_problems(
        self, problems: Iterable[Problem], settings: Mapping[str, Any]
    ) -> list[Problem]:
        """Return the problems of a run with these settings.

        Those caused by a setting get its position in this file.
        """
        return list(
            dict.fromkeys(
                replace(problem, where=self._locate(problem.where, settings))
                for problem in problems
            )
        )

    def _locate(self, where: str, settings: Mapping[str, Any]) -> str:
        if where.startswith('setting "'):
            name, _, path = where.removeprefix('setting "').partition('"')
            part = path.removeprefix(": $").removeprefix(_json_path(name)) if path else ""
            return self._setting_location(name, settings, part) or where
        position, _, path = where.partition(": $")
        if Path(position.rsplit(":", 2)[0]).name != self.scenario.name:
            return where
        pointers = {each: _json_path(each) for each in settings if each.startswith("/")}
        below = [
            location
            for each, start in pointers.items()
            if _is_within(start, path) and (location := self._setting_location(each, settings))
        ]
        return f"{below[0]}, in {where}" if len(below) == 1 else where

    def _setting_location(self, name: str, settings: Mapping[str, Any], part: str = "") -> str:
        """Return the position of a setting in this file, or of a part of its value.

        "" if it is not in this file.
        """
        paths = [path for path in self._setting_paths() if self._is_setting(path, name, settings)]
        return (
            self.document.where(paths[-1]) + (part if paths[-1][-1] == name else "")
            if paths
            else ""
        )

    def _is_setting(
        self, path: tuple[str | int, ...], name: str, settings: Mapping[str, Any]
    ) -> bool:
        """Return whether a path in this file defines a setting, as a key with its value or as a string of "set"."""
        value = _value_at(self.document.value, path)
        return value == name or (path[-1] == name and value == settings.get(name))

    def _setting_paths(self) -> Iterable[tuple[str | int, ...]]:
        """Yield the paths in this file that may define settings, in file order."""
        for path in sorted(self.document.offsets, key=lambda path: self.document.offsets[path]):
            if path and (
                "set" in path or "settings" in path or "levels" in path or "cases" in path
            ):
                yield path


def _json_path(pointer: str) -> str:
    """Return a JSON pointer in the notation of locations, without "$"."""
    return json_path([int(key) if key.isdigit() else key for key in pointer_keys(pointer)])[1:]


def _is_within(path: str, start: str) -> bool:
    return path == start or path.startswith((f"{start}.", f"{start}["))


def _value_at(value: Any, path: tuple[str | int, ...]) -> object:
    for key in path:
        value = value[key]
    return value


def read_study(
    file: str | Path | Mapping[str, Any], kind: type[S], max_runs: int = MAX_RUNS
) -> StudyFile[S]:
    """Read a sweep or tuning from a file, or a shipped one by its name.

    Args:
        file: path of the file, name of a shipped study, or content of a study file.
        kind: schema of the file: SweepSpec, TuneSpec or WorstCaseSpec.
        max_runs: largest accepted number of runs, and of cells of a map.

    Raises:
        InputError: with all problems of the file.
    """
    document = (
        _document_of_dict(file) if isinstance(file, Mapping) else read_document(_find_study(file))
    )
    if (
        isinstance(document.value, dict)
        and "components" in document.value
        and "scenario" not in document.value
    ):
        raise InputError(
            f'"{document.file}" is a scenario, expected a study; `cosim run {document.file}` runs '
            "it"
        )
    try:
        spec = kind.model_validate(document.value)
    except ValidationError as error:
        raise InputError([*document.problems, *schema_problems(kind, document, error)]) from None
    if document.problems:
        raise InputError(document.problems)
    _check_counts(spec, document, max_runs)
    study_file = StudyFile(spec, document)
    try:
        if not paths.is_file(study_file.scenario):
            hint = nearest_file(study_file.scenario)
            raise InputError(f'scenario "{study_file.spec.scenario}" does not exist{hint}')
    except InputError as error:
        raise InputError(
            [replace(problem, where=document.where(("scenario",))) for problem in error.problems]
        ) from None
    if (seeds := document.value.get("seeds")) and "set" not in seeds:
        return StudyFile(
            kind.model_validate(
                {**document.value, "seeds": {**seeds, "set": _seed_pointers(study_file)}}
            ),
            document,
        )
    return study_file


def _document_of_dict(study: Mapping[str, Any]) -> Document:
    if isinstance(study.get("scenario"), Mapping):
        text = "a study runs in other processes, in which Python objects do not exist"
        raise InputError(
            Problem(
                f"{text}; expected a scenario file or the name of a shipped scenario, found a dict",
                "scenario",
            )
        )
    return document_of_dict(study)


def _seed_pointers(study_file: StudyFile[Any]) -> list[str]:
    """Return the JSON pointers that the scenario lists as its seeds."""
    pointers = {
        name: value for name, value in study_file.spec.settings.items() if name.startswith("/")
    }
    if not (seeds := load_scenario(study_file.scenario, pointers).spec.seeds):
        text = 'the key "set" is missing, and the scenario has no "seeds"'
        raise InputError(Problem(text, study_file.document.where(("seeds",))))
    return seeds


def _check_counts(spec: StudySpec, document: Document, max_runs: int) -> None:
    """Raise InputError if there are more than `max_runs` runs or cells of a map.

    The location is that of the largest factor.
    """
    hint = "; --max-runs raises this limit"
    largest, _ = max(spec.run_counts().items(), key=itemgetter(1))
    require_at_most(max_runs, spec.max_runs, "runs", document.where(largest), hint)
    for path, cells in spec.cell_counts().items():
        require_at_most(max_runs, cells, "cells of the map", document.where(path), hint)


def _find_study(file: str | Path) -> Path:
    path = Path(file)
    if path.suffix == ".json" or paths.is_file(path):
        return path
    names = sorted(each.stem for each in (resources.root() / _SHIPPED_FOLDER).glob("*.json"))
    if str(file) not in names:
        raise InputError(f'no file and no shipped sweep "{file}"{did_you_mean(str(file), names)}')
    return resources.root() / _SHIPPED_FOLDER / f"{file}.json"
