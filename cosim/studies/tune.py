"""Tuning: search for parameters that minimise an expression of KPIs under constraints.

Optimizers work in the unit cube. Points are ranked by the rules of K. Deb (Comput. Methods Appl.
Mech. Engrg. 186 (2000), 311-338), from best to worst:

1. points that meet all constraints, by their value;
2. points that violate a constraint, by the sum of violations;
3. points without a value;
4. points with a failed run.

Finished runs are stored, so a tuning that was interrupted repeats its search without making a run
twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, product
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from ..core.errors import InputError, Problem
from ..core.expressions import Expression, parse_expression
from ..core.size_limits import MAX_RUNS
from ..results.files import write_json
from .execution.bundle import cosim_fingerprint
from .execution.job import Job
from .execution.run_store import RunStore
from .factor_schema import TRIAL_COLUMNS
from .optimization import (
    INFEASIBLE_RANK,
    Constraint,
    parameter_settings,
    parse_constraint,
    search,
    start_values,
)
from .schema import TuneSpec
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

#: ranks of points worse than any feasible value, beside INFEASIBLE_RANK; small enough for
#: optimizers to square and add them
_MAX_VALUE, _NO_VALUE_RANK, _FAILED_RANK = 1e99, 1e149, 1e150


@dataclass(frozen=True)
class Trial:
    """Evaluated point of a tuning.

    Attributes:
        parameters: parameter values by name.
        value: value of the objective; NaN: undefined.
        violation: sum of the violations of constraints; 0: all are met.
        failure: cause of the first failed run; empty: none failed.
    """

    parameters: Mapping[str, float]
    value: float
    violation: float = 0.0
    failure: str = ""

    @property
    def rank(self) -> float:
        """Number by which optimizers compare points; lower is better."""
        if self.failure:
            return _FAILED_RANK
        if not self.value < math.inf:
            return _NO_VALUE_RANK
        return (
            min(INFEASIBLE_RANK * (1 + self.violation), _NO_VALUE_RANK)
            if self.violation
            else min(self.value, _MAX_VALUE)
        )

    @property
    def feasible(self) -> bool:
        """True if the point has a value and meets all constraints."""
        return self.rank < INFEASIBLE_RANK


@dataclass
class Tuning:
    """Tuning as its file describes it, and its trials so far."""

    study_file: StudyFile[TuneSpec]
    objective: Expression
    constraints: Sequence[Constraint]
    trials: list[Trial] = field(default_factory=list)
    #: KPIs of the runs so far
    observed_kpis: ObservedKpis = field(default_factory=ObservedKpis)

    @classmethod
    def from_file(cls, file: StudySource, max_runs: int = MAX_RUNS) -> Tuning:
        """Read a tuning file, or a shipped tuning by its name.

        Args:
            file: path, name, or content of the file.
            max_runs: largest accepted number of runs.

        Raises:
            InputError: with all problems of the file.
        """
        study_file = read_study(file, TuneSpec, max_runs)
        problems: list[Problem] = []

        def parse(parser: Callable[[str], Any], text: str, *path: str | int) -> Any:
            try:
                return parser(text)
            except ValueError as error:
                problems.append(Problem(str(error), study_file.document.where(path)))
                return None

        objective = parse(parse_expression, study_file.spec.minimize, "minimize")
        constraints = [
            parse(parse_constraint, text, "constraints", i)
            for i, text in enumerate(study_file.spec.constraints)
        ]
        if problems:
            raise InputError(problems)
        return cls(study_file, objective, constraints)

    @property
    def spec(self) -> TuneSpec:
        """Content of the tuning's file."""
        return self.study_file.spec

    @cached_property
    def study(self) -> Study:
        """Study that makes the runs."""
        return Study(self.study_file, tuple(self.spec.cases))

    def run(self, run_store: RunStore, runner: CheckingRunner, observe: RecordObserver) -> Trial:
        """Search for the best parameters and return the best trial.

        Args:
            run_store: store of finished runs.
            runner: runs the jobs.
            observe: called after every run.

        Raises:
            InputError: before the first run for a parameter or case that cannot be set; after the
                first runs for unknown names in the objective or a constraint.
        """
        self.study.check_jobs(runner, self._jobs(start_values(self.spec.parameters)))

        def evaluate(parameters: Sequence[Mapping[str, float]]) -> list[float]:
            run_pending(
                chain.from_iterable(map(self._jobs, parameters)),
                run_store,
                runner,
                observe,
            )
            trials = [self._trial(each, run_store) for each in parameters]
            self.trials += trials
            if self.observed_kpis.has_enough_runs:
                self._check_names()
            return [trial.rank for trial in trials]

        search(evaluate, self.spec.parameters, self.spec.method)
        self._check_names()
        return min(self.trials, key=lambda trial: trial.rank)

    def settings(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Return the settings of the scenario for these parameters."""
        return parameter_settings(self.spec.parameters, parameters)

    def _jobs(self, point: Mapping[str, float]) -> list[Job]:
        settings = self.settings(point)
        return [self.study.job({**case, **settings}) for case in self.spec.cases]

    def _trial(self, parameters: Mapping[str, float], run_store: RunStore) -> Trial:
        records = [run_store[job.key] for job in self._jobs(parameters)]
        for record in records:
            self.observed_kpis.add(record)
        if failures := [record.failure for record in records if record.failure]:
            return Trial(parameters, math.nan, math.inf, failures[0])
        operands = [{**record.kpis, **parameters} for record in records]
        values = [self.objective(each) for each in operands]
        value = float(np.max(values)) if self.spec.over_cases == "max" else fmean(values)
        violations = (
            constraint.violation(each) for constraint, each in product(self.constraints, operands)
        )
        return Trial(parameters, value, sum(violations))

    def _check_names(self) -> None:
        """Raise InputError for names that are neither a parameter nor a KPI of any run.

        Pass if no run has succeeded.
        """
        if not self.observed_kpis.runs:
            return
        names = (each.name for each in self.spec.parameters)
        known = {**self.observed_kpis.kpis, **dict.fromkeys(names)}
        problems = []

        def check(expression: Expression, *path: str | int) -> None:
            if text := expression.unknown_name_problem(known):
                problems.append(Problem(text, self.study_file.document.where(path)))

        check(self.objective, "minimize")
        for i, constraint in enumerate(self.constraints):
            check(constraint.left, "constraints", i)
            check(constraint.right, "constraints", i)
        if problems:
            raise InputError(problems)


def write_tuning_files(tuning: Tuning, folder: Path) -> Trial:
    """Write trials.csv and best.json and return the best trial.

    There must be at least one trial.
    """
    names = [spec.name for spec in tuning.spec.parameters]
    lines = (
        [*trial.parameters.values(), trial.value, trial.violation, trial.failure]
        for trial in tuning.trials
    )
    write_csv_rows([*names, *TRIAL_COLUMNS], lines, folder / "trials.csv")
    best = min(tuning.trials, key=lambda trial: trial.rank)
    write_json(describe_best(tuning, best), folder / "best.json")
    return best


def describe_best(tuning: Tuning, best: Trial) -> dict[str, Any]:
    """Return the best trial with everything that its evaluation depends on, as a JSON value."""
    return {
        "name": tuning.spec.name,
        "tuning": tuning.study_file.document.value,
        "parameters": best.parameters,
        "settings": tuning.settings(best.parameters),
        "value": best.value,
        "violation": best.violation,
        "trials": len(tuning.trials),
        "cosim": cosim_fingerprint(),
        "sha256": dict(tuning.study.bundle.files),
    }
