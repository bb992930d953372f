"""A study: the runs of one scenario under many settings, each of them made once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

from ..core.errors import InputError, Problem
from ..results.checks import Number
from ..scenario import load_scenario
from .document import StudyFile
from .execution.bundle import Bundle, collect_bundle, fmu_paths
from .execution.job import Job, Record, Runner, StudyContext, run_key
from .execution.run_store import RunStore
from .schema import StudySpec

#: called after every run with its record
RecordObserver = Callable[[Record], None]

#: so many runs without a KPI are taken to mean that there is none of that name
_ENOUGH_RUNS = 10


@dataclass(frozen=True)
class Study:
    """A scenario with the changes that all runs share; `variants` are settings that may name further files."""

    study_file: StudyFile[Any]
    setting_variants: tuple[Mapping[str, Any], ...] = ()

    @property
    def spec(self) -> StudySpec:
        spec: StudySpec = self.study_file.spec
        return spec

    @cached_property
    def all_setting_variants(self) -> list[dict[str, Any]]:
        return [{**self.spec.settings, **variant} for variant in ({}, *self.setting_variants)]

    @cached_property
    def bundle(self) -> Bundle:
        """Everything that the runs need."""
        return collect_bundle(self.study_file.scenario, self.all_setting_variants)

    @property
    def context(self) -> StudyContext:
        return StudyContext(self.study_file.scenario, self.bundle.root, self.spec.deadline, fmu_paths(self.bundle.files))

    def job(self, settings: Mapping[str, Any]) -> Job:
        """The run with these settings beside the common ones."""
        together = {**self.spec.settings, **settings}
        return Job(run_key(self.bundle.digest, together), together)

    @cached_property
    def checks(self) -> list[dict[str, Any]]:
        """The checks of the scenario."""
        spec = load_scenario(self.study_file.scenario, {k: v for k, v in self.spec.settings.items() if k.startswith("/")}).spec
        return [check.model_dump(exclude_none=True) for check in spec.checks]

    def check_jobs(self, engine: CheckingRunner, jobs: Iterable[Job]) -> None:
        """Raises InputError, with places in the study's own file, when some of these jobs cannot be run."""
        if problems := [found for job in jobs for found in self.study_file.locate_problems(engine.check(job), job.settings)]:
            raise InputError(dict.fromkeys(problems))


@dataclass
class ObservedKpis:
    """The KPIs of successful runs so far: which there are is not known before, and one run may have fewer than another."""

    runs: int = 0
    kpis: dict[str, Number] = field(default_factory=dict)

    def add(self, record: Record) -> None:
        if not record.failure:
            self.runs += 1
            self.kpis |= record.kpis

    @property
    def has_enough_runs(self) -> bool:
        """Whether names that are not among them may be called wrong before all runs are made."""
        return self.runs >= _ENOUGH_RUNS


class CheckingRunner(Runner, AbstractContextManager["CheckingRunner"], Protocol):
    """An engine that is a context and can check jobs."""

    def check(self, job: Job) -> list[Problem]: ...


def run_pending(jobs: Iterable[Job], ledger: RunStore, engine: Runner, observe: RecordObserver) -> None:
    """Run what is not done; every record is kept as soon as it is there."""
    for record in engine.run_jobs(ledger.claim_jobs(jobs)):
        ledger.add(record)
        observe(record)
