"""Search for the run that breaks a controller.

Wind, waves, faults and seeds with which a run misses its checks the most.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.size_limits import MAX_RUNS
from ..results.checks import CheckOutcome, evaluate_all_checks, evaluate_checks
from ..results.files import write_json
from ..scenario.nested_systems import extending_scenario
from .execution.bundle import cosim_fingerprint
from .execution.job import Job
from .execution.run_store import RunStore
from .optimization import parameter_settings, search, start_values
from .schema import WorstCaseSpec
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
from .summary.table import write_csv_rows

#: severity of a run that failed; that of a check without a value, or of a wrong truth value
_FAILED, _WRONG = 10.0, 1.0


@dataclass(frozen=True)
class Attempt:
    """Run of a search.

    Attributes:
        parameters: Values of the parameters by name.
        severity: Largest excess of a KPI over its limit, as a fraction of the limit; negative: all
            checks passed.
        reason: The check that is missed by most or is closest to its limit, or the failure of the
            run.
        passed: All checks of the run passed.
    """

    parameters: Mapping[str, float]
    severity: float
    reason: str
    passed: bool


@dataclass
class WorstCase:
    """Search as its file describes it, and its runs so far."""

    study_file: StudyFile[WorstCaseSpec]
    attempts: list[Attempt] = field(default_factory=list)
    observed_kpis: ObservedKpis = field(default_factory=ObservedKpis)

    @classmethod
    def from_file(cls, file: StudySource, max_runs: int = MAX_RUNS) -> WorstCase:
        """Read a file, or a shipped search by its name.

        Args:
            file: Path, name, or content of the file.
            max_runs: Largest accepted number of runs.

        Raises:
            InputError: With all problems of the file.
        """
        search = cls(read_study(file, WorstCaseSpec, max_runs))
        if not search.criteria:
            raise InputError(
                f'{search.spec.name}: nothing can break, expected "success" or checks of the '
                "scenario"
            )
        return search

    @property
    def spec(self) -> WorstCaseSpec:
        """Content of the file."""
        return self.study_file.spec

    @cached_property
    def study(self) -> Study:
        """Study that makes the runs."""
        return Study(self.study_file)

    @cached_property
    def criteria(self) -> list[dict[str, Any]]:
        """Checks that a run must meet."""
        return self.study.criteria(self.spec.success)

    @property
    def counterexamples(self) -> list[Attempt]:
        """The worst runs that miss a check, without repetitions, at most `keep`."""
        broken = {
            tuple(each.parameters.values()): each for each in self.attempts if not each.passed
        }
        return sorted(broken.values(), key=lambda each: -each.severity)[: self.spec.keep]

    @property
    def worst(self) -> Attempt:
        """The worst run; there must be one."""
        return max(self.attempts, key=lambda each: each.severity)

    def run(self, run_store: RunStore, runner: CheckingRunner, observe: RecordObserver) -> None:
        """Search for the worst run.

        Args:
            run_store: Store of finished runs.
            runner: Runs the jobs.
            observe: Called after every run.

        Raises:
            InputError: A parameter cannot be set, or a check names no KPI of any run.
        """
        unknown = self.study.unknown_criteria(check.kpi for check in self.spec.success or ())
        start = start_values(self.spec.parameters)
        self.study.check_jobs(runner, [self._job(start)], unknown)

        def evaluate(values: Sequence[Mapping[str, float]]) -> list[float]:
            run_pending(map(self._job, values), run_store, runner, observe)
            found = [self._attempt(each, run_store) for each in values]
            self.attempts += found
            return [-each.severity for each in found]

        search(evaluate, self.spec.parameters, self.spec.method)
        if self.observed_kpis.runs:
            evaluate_checks(self.observed_kpis.kpis, self.criteria)

    def settings(self, attempt: Attempt) -> dict[str, Any]:
        """Return all settings of the scenario for a run, with the checks that it must meet."""
        checks = {} if self.spec.success is None else {"/checks": self.criteria}
        return {
            **self.spec.settings,
            **checks,
            **parameter_settings(self.spec.parameters, attempt.parameters),
        }

    def _job(self, values: Mapping[str, float]) -> Job:
        return self.study.job(parameter_settings(self.spec.parameters, values))

    def _attempt(self, values: Mapping[str, float], run_store: RunStore) -> Attempt:
        record = run_store[self._job(values).key]
        self.observed_kpis.add(record)
        if record.failure:
            return Attempt(values, _FAILED, record.failure, False)
        outcomes = evaluate_all_checks(record.kpis, self.criteria)
        closest = max(outcomes, key=severity)
        return Attempt(
            values,
            severity(closest),
            closest.text(run_store.units),
            all(outcome.passed for outcome in outcomes),
        )


def severity(outcome: CheckOutcome) -> float:
    """Return the excess of a KPI over its limit as a fraction of the limit, or of 1 if it is 0.

    Negative: within the limit.
    """
    value, check = outcome.value, outcome.check
    if math.isnan(value) or ("equals" in check and not outcome.passed):
        return _WRONG
    excesses = [-_WRONG]
    for key, sign in (("max", 1), ("min", -1)):
        if key in check:
            excesses.append(sign * (value - check[key]) / (abs(check[key]) or 1))
    return min(max(excesses[1:] or excesses), _FAILED)


def write_worst_case_files(search: WorstCase, folder: Path) -> list[Path]:
    """Write trials.csv and worst.json, and each counterexample as a scenario.

    The scenarios extend that of the search.

    Returns:
        The files of the counterexamples, the worst one first.
    """
    names = [spec.name for spec in search.spec.parameters]
    rows = (
        [*each.parameters.values(), each.severity, each.passed, each.reason]
        for each in search.attempts
    )
    write_csv_rows([*names, "severity", "passed", "reason"], rows, folder / "trials.csv")
    write_json(describe_worst_case(search), folder / "worst.json")
    files, scenario = [], search.study_file.scenario
    for number, each in enumerate(search.counterexamples, 1):
        name = f"{search.spec.name}_{number}"
        file = folder / "counterexamples" / f"{name}.json"
        file.parent.mkdir(exist_ok=True)
        settings = search.settings(each)
        write_json(
            extending_scenario(scenario, file.parent, name, each.reason, settings, scenario.parent),
            file,
        )
        files.append(file)
    return files


def describe_worst_case(search: WorstCase) -> dict[str, Any]:
    """Return the worst run and the counterexamples, with all that they depend on, as JSON."""
    return {
        "name": search.spec.name,
        "search": search.study_file.document.value,
        "worst": vars(search.worst),
        "counterexamples": [vars(each) for each in search.counterexamples],
        "runs": len(search.attempts),
        "cosim": cosim_fingerprint(),
        "sha256": dict(search.study.bundle.files),
    }
