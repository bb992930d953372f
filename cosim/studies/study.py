"""Study of a scenario: its runs with many settings, each of them made once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

from ..core.errors import InputError, Problem
from ..results.checks import Number
from ..scenario import load_scenario
from ..scenario.named_functions import kpi_name_problem
from ..scenario.nested_systems import Scenario
from ..scenario.schema_types import accepted
from .document import StudyFile
from .execution.bundle import Bundle, collect_bundle, fmu_paths
from .execution.job import Job, Record, Runner, StudyContext, run_key
from .execution.run_store import RunStore
from .schema import StudySpec

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

    @cached_property
    def checks(self) -> list[dict[str, Any]]:
        """Checks of the scenario with the common settings."""
        return [check.model_dump(exclude_none=True) for check in self._scenario.spec.checks]

    @cached_property
    def _scenario(self) -> Scenario:
        """Scenario with the common settings of its file."""
        file = self.study_file.scenario
        return load_scenario(
            file, {k: v for k, v in self.spec.settings.items() if k.startswith("/")}, file.parent
        )

    def unknown_criteria(self, names: Iterable[str]) -> list[Problem]:
        """Return the problems of criteria of success whose KPIs cannot result from the functions of the scenario.

        Args:
            names: names of the KPIs, in the order of "success".
        """
        kpis, folder = (
            [kpi for _, kpi in accepted(self._scenario.spec.kpis)],
            self._scenario.root.folder,
        )
        return [
            Problem(text, self.study_file.document.where(("success", i, "kpi")))
            for i, name in enumerate(names)
            if (text := kpi_name_problem(name, kpis, folder))
        ]

    def check_jobs(
        self, runner: CheckingRunner, jobs: Iterable[Job], problems: Iterable[Problem] = ()
    ) -> None:
        """Raise InputError with `problems` and, with positions in the study's file, those for which these jobs cannot be run."""
        found = [
            problem
            for job in jobs
            for problem in self.study_file.locate_problems(runner.check(job), job.settings)
        ]
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
        """True if a name that is not among the KPIs may be reported as unknown before all runs have finished."""
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
