"""Study of a scenario: its file, and its runs with many settings, each of them made once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import cached_property
from operator import itemgetter
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from pydantic import ValidationError

from ..core import paths, resources
from ..core.errors import InputError, Problem, did_you_mean, nearest_file
from ..core.size_limits import MAX_RUNS, require_at_most
from ..results.checks import Number
from ..scenario import load_scenario
from ..scenario.evaluation_schema import CheckSpec
from ..scenario.file_paths import find_scenario
from ..scenario.json_document import Document, json_path, pointer_keys, read_document
from ..scenario.named_functions import kpi_name_problem
from ..scenario.nested_systems import Scenario
from ..scenario.schema_types import accepted
from ..scenario.settings import document_of_dict
from ..scenario.validation import schema_problems
from .execution.bundle import Bundle, collect_bundle, fmu_paths
from .execution.job import Job, Record, Runner, StudyContext, run_key
from .execution.run_store import RunStore
from .schema import StudySpec

#: a study file, the name of a shipped study, or the content of a study file
StudySource = str | Path | Mapping[str, Any]
#: callback after every run
RecordObserver = Callable[[Record], None]

#: after this many runs without a KPI, its name is reported as unknown
_ENOUGH_RUNS = 10


@dataclass(frozen=True)
class Study:
    """Scenario with settings that all runs share.

    `setting_variants` are further settings whose strings may name files.
    """

    study_file: StudyFile[Any]
    setting_variants: tuple[Mapping[str, Any], ...] = ()

    @property
    def spec(self) -> StudySpec:
        """The content of the study's file."""
        spec: StudySpec = self.study_file.spec
        return spec

    @cached_property
    def all_setting_variants(self) -> list[dict[str, Any]]:
        """The common settings, alone and with each of the variants."""
        return [{**self.spec.settings, **variant} for variant in ({}, *self.setting_variants)]

    @cached_property
    def bundle(self) -> Bundle:
        """All files that the runs need."""
        return collect_bundle(self.study_file.scenario, self.all_setting_variants)

    @property
    def context(self) -> StudyContext:
        """Properties that all runs share, as a runner needs them."""
        return StudyContext(
            self.study_file.scenario,
            self.bundle.root,
            self.spec.deadline,
            fmu_paths(self.bundle.files),
        )

    def job(self, settings: Mapping[str, Any]) -> Job:
        """Return the run with these settings in addition to the common ones."""
        combined = {**self.spec.settings, **settings}
        return Job(run_key(self.bundle.digest, combined), combined)

    def criteria(self, success: Sequence[CheckSpec] | None) -> list[dict[str, Any]]:
        """Return the checks of success; None: those of the scenario with the common settings."""
        checks = self._scenario.spec.checks if success is None else success
        return [check.model_dump(exclude_none=True) for check in checks]

    @cached_property
    def _scenario(self) -> Scenario:
        """Scenario with the common settings of its file."""
        file = self.study_file.scenario
        return load_scenario(
            file, {k: v for k, v in self.spec.settings.items() if k.startswith("/")}, file.parent
        )

    def unknown_criteria(self, names: Iterable[str]) -> list[Problem]:
        """Return the problems of criteria of success with unknown KPIs.

        These cannot result from the functions of the scenario.

        Args:
            names: names of the KPIs, in the order of "success".
        """
        kpis = [kpi for _, kpi in accepted(self._scenario.spec.kpis)]
        folder = self._scenario.root.folder
        problems = []
        for i, name in enumerate(names):
            if text := kpi_name_problem(name, kpis, folder):
                where = self.study_file.document.where(("success", i, "kpi"))
                problems.append(Problem(text, where))
        return problems

    def check_jobs(
        self, runner: CheckingRunner, jobs: Iterable[Job], problems: Iterable[Problem] = ()
    ) -> None:
        """Raise InputError with the problems for which these jobs cannot be run.

        They have positions in the study's file. `problems` are added to them.
        """
        found: list[Problem] = []
        for job in jobs:
            found += self.study_file.locate_problems(runner.check(job), job.settings)
        if found := [*found, *problems]:
            raise InputError(dict.fromkeys(found))


@dataclass
class ObservedKpis:
    """KPIs of the successful runs so far.

    Their names are unknown before a run, and runs may differ in them.
    """

    runs: int = 0
    kpis: dict[str, Number] = field(default_factory=dict)

    def add(self, record: Record) -> None:
        """Add the KPIs of a finished run unless it failed."""
        if not record.failure:
            self.runs += 1
            self.kpis |= record.kpis

    @property
    def has_enough_runs(self) -> bool:
        """True if unknown names may be reported before all runs have finished."""
        return self.runs >= _ENOUGH_RUNS


class CheckingRunner(Runner, AbstractContextManager["CheckingRunner"], Protocol):
    """Runner that is a context manager and can check jobs without running them."""

    def check(self, job: Job) -> list[Problem]:
        """Return the problems for which a job cannot be run."""
        ...


def run_pending(
    jobs: Iterable[Job], run_store: RunStore, runner: Runner, observe: RecordObserver
) -> None:
    """Run the jobs that are not finished.

    Store each record and call `observe` with it as soon as its run has ended.
    """
    for record in runner.run_jobs(run_store.claim_jobs(jobs)):
        run_store.add(record)
        observe(record)


S = TypeVar("S", bound=StudySpec)

_SHIPPED_FOLDER = Path("scenarios") / "sweeps"
#: keys of a study file whose values contain settings
_SETTING_KEYS = frozenset(("set", "settings", "levels", "cases"))


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
        locations = (
            self._setting_location(each, settings)
            for each, below in pointers.items()
            if below == path or below.startswith((f"{path}.", f"{path}["))
        )
        found = list(filter(None, locations))
        return f"{found[0]}, in {where}" if len(found) == 1 else where

    def _setting_location(self, name: str, settings: Mapping[str, Any], part: str = "") -> str:
        """Return the position of a setting in this file, or of a part of its value.

        "" if it is not in this file.
        """
        found: tuple[str | int, ...] = ()
        for path in sorted(self.document.offsets, key=self.document.offsets.__getitem__):
            if _SETTING_KEYS.isdisjoint(path):
                continue
            value = self.document.value
            for key in path:
                value = value[key]
            # a text of "set", or a key with its value
            if value == name or (path[-1] == name and value == settings.get(name)):
                found = path
        if not found:
            return ""
        return self.document.where(found) + (part if found[-1] == name else "")


def _json_path(pointer: str) -> str:
    """Return a JSON pointer in the notation of locations, without "$"."""
    return json_path([int(key) if key.isdigit() else key for key in pointer_keys(pointer)])[1:]


def read_study(file: StudySource, kind: type[S], max_runs: int = MAX_RUNS) -> StudyFile[S]:
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
    hint = "; --max-runs raises this limit"
    largest, _ = max(spec.run_counts().items(), key=itemgetter(1))
    require_at_most(max_runs, spec.max_runs, "runs", document.where(largest), hint)
    for path, cells in spec.cell_counts().items():
        require_at_most(max_runs, cells, "cells of the map", document.where(path), hint)
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


def _find_study(file: str | Path) -> Path:
    path = Path(file)
    if path.suffix == ".json" or paths.is_file(path):
        return path
    names = sorted(each.stem for each in (resources.root() / _SHIPPED_FOLDER).glob("*.json"))
    if str(file) not in names:
        raise InputError(f'no file and no shipped sweep "{file}"{did_you_mean(str(file), names)}')
    return resources.root() / _SHIPPED_FOLDER / f"{file}.json"
