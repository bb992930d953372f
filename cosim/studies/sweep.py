"""A sweep: all points of a design."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

from ..core.errors import InputError, Problem
from ..results.checks import Number, evaluate_checks
from .design import Design, Point, build_design
from .document import StudyFile, read_study
from .execution.job import Job, Record
from .execution.run_store import RunStore
from .schema import SweepSpec
from .study import CheckingRunner, ObservedKpis, RecordObserver, Study, run_pending

#: so many points are tried at most before anything runs
_MAX_CHECKED_POINTS = 20


@dataclass(frozen=True)
class SweepRow:
    """A finished run of a sweep: its number, its point, what became of it, and whether that was a success.

    `shared` says that other points have the very same run.
    """

    run: int
    point: Point
    record: Record
    passed: bool
    shared: bool = False


@dataclass(frozen=True)
class Sweep:
    """A sweep as its file describes it."""

    study_file: StudyFile[SweepSpec]
    design: Design

    @classmethod
    def from_file(cls, file: str | Path) -> Sweep:
        """Read a sweep file, or a shipped one by its name. Raises InputError with everything that is wrong in it."""
        found = read_study(file, SweepSpec)
        return cls(found, build_design(found.spec))

    @cached_property
    def study(self) -> Study:
        return Study(self.study_file, tuple(self.design.level_settings()))

    def __len__(self) -> int:
        return len(self.design)

    def jobs(self) -> Iterator[Job]:
        return (self.study.job(point.settings) for point in self.design)

    @cached_property
    def keys(self) -> list[str]:
        """Keys of all runs."""
        return [job.key for job in self.jobs()]

    @cached_property
    def shared_keys(self) -> frozenset[str]:
        """Keys of runs that several points have."""
        return frozenset(key for key, count in Counter(self.keys).items() if count > 1)

    @cached_property
    def criteria(self) -> list[dict[str, Any]]:
        """What a run must meet to count as a success."""
        own = self.study_file.spec.success
        return self.study.checks if own is None else [check.model_dump(exclude_none=True) for check in own]

    def passed(self, kpis: Mapping[str, Number]) -> bool:
        """Whether these KPIs are a success; without one that the criteria are about they are none."""
        known = all(check["kpi"] in kpis for check in self.criteria)
        return known and all(outcome.passed for outcome in evaluate_checks(kpis, self.criteria))

    def check(self, engine: CheckingRunner) -> None:
        """Raises InputError with everything that keeps a level of a factor from being run."""
        points = islice(self._representatives(), _MAX_CHECKED_POINTS)
        self.study.check_jobs(engine, (self.study.job(point.settings) for point in points))

    def _representatives(self) -> Iterator[Point]:
        """The first point, and the first with each further listed level of a factor."""
        seen: set[tuple[str, str]] = set()
        listed = {factor.name for factor in self.design.factors if factor.listed_levels}
        wanted = 1 + sum(len(factor.listed_levels) for factor in self.design.factors)
        for point in self.design:
            new = {(name, repr(label)) for name, label in point.labels.items() if name in listed} - seen
            if new or not seen:
                seen |= new | {("", "")}
                yield point
            if len(seen) == wanted:
                return

    def run(self, ledger: RunStore, engine: CheckingRunner, observe: RecordObserver) -> None:
        """Run what is not done. Raises InputError before anything runs, and when the first runs show criteria to be wrong."""
        seen = ObservedKpis()

        def look(record: Record) -> None:
            seen.add(record)
            self._check_factor_names(record.kpis)
            if seen.has_enough_runs:
                self._check_criteria(seen)
            observe(record)

        self.check(engine)
        run_pending(self.jobs(), ledger, engine, look)

    def check_names(self, ledger: RunStore) -> None:
        """Raises InputError for criteria about KPIs that no run has, and for factors that are called like a KPI."""
        seen = ObservedKpis()
        for row in self.rows(ledger):
            seen.add(row.record)
        self._check_factor_names(seen.kpis)
        self._check_criteria(seen)

    def _check_factor_names(self, kpis: Mapping[str, Number]) -> None:
        names = [factor.name for factor in self.study_file.spec.factors]
        places = {name: self.study_file.document.where(("factors", i, "name")) for i, name in enumerate(names) if name in kpis}
        if places:
            raise InputError(
                [Problem(f'expected a name other than that of the KPI "{each}"', where) for each, where in places.items()]
            )

    def _check_criteria(self, seen: ObservedKpis) -> None:
        if seen.runs:
            evaluate_checks(seen.kpis, self.criteria)

    def rows(self, ledger: RunStore) -> Iterator[SweepRow]:
        """Finished runs in the order of the design."""
        for run, key in enumerate(self.keys):
            if key in ledger:
                record = ledger[key]
                passed = not record.failure and self.passed(record.kpis)
                yield SweepRow(run, self.design[run], record, passed, key in self.shared_keys)


def kpi_names(rows: Iterable[SweepRow]) -> list[str]:
    """Names of all KPIs, in the order in which runs show them."""
    return list(dict.fromkeys(name for row in rows for name in row.record.kpis))
