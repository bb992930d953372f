"""Sweep: the runs of a scenario at all points of a design."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, islice
from typing import Any

from ..core.errors import InputError, Problem
from ..core.size_limits import MAX_RUNS
from ..results.checks import CheckOutcome, Number, evaluate_all_checks, evaluate_checks, kpi_hint
from .design import Design, Point, build_design
from .execution.job import Job, Record, RunKey
from .execution.run_store import RunStore
from .schema import SweepSpec
from .study import (
    CheckingRunner,
    ObservedKpis,
    RecordObserver,
    Study,
    StudyFile,
    StudySource,
    read_study,
    run_pending,
)

#: number of points that are checked before the first run
_MAX_CHECKED_POINTS = 20


@dataclass(frozen=True)
class SweepRow:
    """Finished run of a sweep.

    Attributes:
        run: number of the point in the design.
        point: labels and settings.
        record: outcome of the run.
        passed: whether the run meets the criteria of success.
        shared: whether other points have the same run.
    """

    run: int
    point: Point
    record: Record
    passed: bool
    shared: bool = False


@dataclass(frozen=True)
class Sweep:
    """Sweep as its file describes it."""

    study_file: StudyFile[SweepSpec]
    design: Design

    @classmethod
    def from_file(cls, file: StudySource, max_runs: int = MAX_RUNS) -> Sweep:
        """Read a sweep file, or a shipped sweep by its name.

        Args:
            file: path, name, or content of the file.
            max_runs: largest accepted number of runs.

        Raises:
            InputError: with all problems of the file.
        """
        study_file = read_study(file, SweepSpec, max_runs)
        return cls(study_file, build_design(study_file.spec))

    @cached_property
    def study(self) -> Study:
        """Study that makes the runs."""
        return Study(self.study_file, tuple(self.design.level_settings()))

    def __len__(self) -> int:
        return len(self.design)

    def jobs(self) -> Iterator[Job]:
        """Yield the jobs of all points in the order of the design."""
        return (self.study.job(point.settings) for point in self.design)

    @cached_property
    def keys(self) -> list[RunKey]:
        """Keys of the runs of all points."""
        return [job.key for job in self.jobs()]

    @cached_property
    def shared_keys(self) -> frozenset[RunKey]:
        """Keys of the runs that several points have in common."""
        return frozenset(key for key, count in Counter(self.keys).items() if count > 1)

    @cached_property
    def criteria(self) -> list[dict[str, Any]]:
        """Checks that a run must meet to be a success."""
        return self.study.criteria(self.study_file.spec.success)

    def missed(self, kpis: Mapping[str, Number]) -> list[CheckOutcome]:
        """Return the criteria that these KPIs do not meet.

        A missing KPI has the value NaN and meets none.
        """
        return [
            outcome for outcome in evaluate_all_checks(kpis, self.criteria) if not outcome.passed
        ]

    def check(self, runner: CheckingRunner) -> None:
        """Raise InputError with all problems of the factors' levels and of the criteria's names."""
        points = islice(self._representatives(), _MAX_CHECKED_POINTS)
        jobs = (self.study.job(point.settings) for point in points)
        # names are unknown before the runs if levels change the KPI functions of the scenario
        names = chain(self.design[0].settings, *self.design.level_settings())
        varies_kpis = any(name.startswith("/kpis") for name in names)
        problems = [] if varies_kpis else self.study.unknown_criteria(self._own_criteria)
        self.study.check_jobs(runner, jobs, problems)

    @property
    def _own_criteria(self) -> list[str]:
        """Names of the KPIs in the sweep's own criteria."""
        return [check.kpi for check in self.study_file.spec.success or ()]

    def _representatives(self) -> Iterator[Point]:
        """Yield the first point, and the first point with each further listed level of a factor."""
        seen: set[tuple[str, str]] = set()
        listed = {factor.name for factor in self.design.factors if factor.listed_levels}
        complete = 1 + sum(len(factor.listed_levels) for factor in self.design.factors)
        for point in self.design:
            new = {
                (name, repr(label)) for name, label in point.labels.items() if name in listed
            } - seen
            if new or not seen:
                seen |= new | {("", "")}
                yield point
            if len(seen) == complete:
                return

    def run(self, run_store: RunStore, runner: CheckingRunner, observe: RecordObserver) -> None:
        """Run the points that are not finished.

        Args:
            run_store: store of finished runs.
            runner: runs the jobs.
            observe: called after every run.

        Raises:
            InputError: before the first run for a level that cannot be set and for unknown KPIs in
                criteria; after the first runs for KPIs in criteria whose function gives names that
                its source does not show.
        """
        observed_kpis = ObservedKpis()

        def check_and_observe(record: Record) -> None:
            observed_kpis.add(record)
            self._check_factor_names(record.kpis)
            if observed_kpis.has_enough_runs:
                self._check_criteria(observed_kpis)
            observe(record)

        self.check(runner)
        run_pending(self.jobs(), run_store, runner, check_and_observe)

    def check_names(self, run_store: RunStore) -> None:
        """Raise InputError for criteria whose KPI no run has, and for factors named like a KPI."""
        observed_kpis = ObservedKpis()
        for row in self.rows(run_store):
            observed_kpis.add(row.record)
        self._check_factor_names(observed_kpis.kpis)
        self._check_criteria(observed_kpis)

    def _check_factor_names(self, kpis: Mapping[str, Number]) -> None:
        names = [factor.name for factor in self.study_file.spec.factors]
        where = self.study_file.document.where
        if problems := [
            Problem(
                f'expected a name other than that of the KPI "{name}"',
                where(("factors", i, "name")),
            )
            for i, name in enumerate(names)
            if name in kpis
        ]:
            raise InputError(problems)

    def _check_criteria(self, observed_kpis: ObservedKpis) -> None:
        if not observed_kpis.runs:
            return
        kpis, where = observed_kpis.kpis, self.study_file.document.where
        if problems := [
            Problem(f'no KPI "{name}"{kpi_hint(name, kpis)}', where(("success", i, "kpi")))
            for i, name in enumerate(self._own_criteria)
            if name not in kpis
        ]:
            raise InputError(problems)
        evaluate_checks(kpis, self.criteria)

    def rows(self, run_store: RunStore) -> Iterator[SweepRow]:
        """Yield the finished runs in the order of the design."""
        for run, key in enumerate(self.keys):
            if key in run_store:
                record = run_store[key]
                passed = not record.failure and not self.missed(record.kpis)
                yield SweepRow(run, self.design[run], record, passed, key in self.shared_keys)


def kpi_names(rows: Iterable[SweepRow]) -> list[str]:
    """Return the names of all KPIs in order of appearance."""
    return list(dict.fromkeys(chain.from_iterable(row.record.kpis for row in rows)))
