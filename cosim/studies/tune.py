"""A tuning: the parameters within bounds that make an expression of KPIs small and keep the constraints.

Optimizers see a point as a place in the unit cube. Points are compared as by K. Deb (Comput. Methods Appl. Mech. Engrg. 186
(2000), 311-338): one that meets the constraints is better than one that does not, of those the smaller value, of these the
smaller violation; then come points without a value, and last those where a run failed. Every run is kept in the ledger, so a
tuning that was killed and is called again repeats its way without running anything twice.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from ..core.errors import InputError, Problem
from .design import interpolate
from .document import StudyFile, read_study
from .execution.job import Job
from .execution.run_store import RunStore
from .objective import Constraint, Expression, parse_constraint, parse_expression
from .schema import MethodSpec, ParameterSpec, TuneSpec
from .study import CheckingRunner, ObservedKpis, RecordObserver, Study, run_pending

#: ranks of what is worse than any value: violations, no value, a failure; optimizers can still square and add them
_MAX_VALUE, _INFEASIBLE_RANK, _NO_VALUE_RANK, _FAILED_RANK = 1e99, 1e100, 1e149, 1e150
#: differential evolution has converged when values differ by so much of their mean
_CONVERGENCE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Trial:
    """A point that was tried: its parameters, the value to be minimised, the sum of violations, and the cause of a failure."""

    parameters: Mapping[str, float]
    value: float
    violation: float = 0.0
    failure: str = ""

    @property
    def rank(self) -> float:
        """Smaller is better."""
        if self.failure:
            return _FAILED_RANK
        if not self.value < math.inf:
            return _NO_VALUE_RANK
        return min(_INFEASIBLE_RANK * (1 + self.violation), _NO_VALUE_RANK) if self.violation else min(self.value, _MAX_VALUE)

    @property
    def feasible(self) -> bool:
        return self.rank < _INFEASIBLE_RANK


@dataclass
class Tuning:
    """A tuning as its file describes it, and its trials so far."""

    study_file: StudyFile[TuneSpec]
    objective: Expression
    constraints: Sequence[Constraint]
    trials: list[Trial] = field(default_factory=list)
    #: the KPIs of runs so far
    observed_kpis: ObservedKpis = field(default_factory=ObservedKpis)

    @classmethod
    def from_file(cls, file: str | Path) -> Tuning:
        """Read a tuning file, or a shipped one by its name. Raises InputError with everything that is wrong in it."""
        found = read_study(file, TuneSpec)
        problems: list[Problem] = []

        def parsed(kind: Callable[[str], Any], text: str, *path: str | int) -> Any:
            try:
                return kind(text)
            except ValueError as error:
                problems.append(Problem(str(error), found.document.where(path)))

        objective = parsed(parse_expression, found.spec.minimize, "minimize")
        constraints = [parsed(parse_constraint, text, "constraints", i) for i, text in enumerate(found.spec.constraints)]
        if problems:
            raise InputError(problems)
        return cls(found, objective, constraints)

    @property
    def spec(self) -> TuneSpec:
        return self.study_file.spec

    @cached_property
    def study(self) -> Study:
        return Study(self.study_file, tuple(self.spec.cases))

    def run(self, ledger: RunStore, engine: CheckingRunner, observe: RecordObserver) -> Trial:
        """The best trial. Raises InputError before anything runs when a parameter or case cannot be set."""
        self.study.check_jobs(engine, self._jobs([_start_parameters(self.spec)]))

        def evaluate(places: Sequence[Sequence[float]]) -> list[float]:
            parameters = [self._parameters(place) for place in places]
            run_pending((job for each in parameters for job in self._jobs([each])), ledger, engine, observe)
            found = [self._trial(each, ledger) for each in parameters]
            self.trials += found
            if self.observed_kpis.has_enough_runs:
                self._check_names()
            return [trial.rank for trial in found]

        METHODS[self.spec.method.kind](evaluate, _start_positions(self.spec), self.spec.method)
        self._check_names()
        return min(self.trials, key=lambda trial: trial.rank)

    def settings(self, parameters: Mapping[str, float]) -> dict[str, float]:
        """Parameters as changes to the scenario."""
        return {path: parameters[each.name] for each in self.spec.parameters for path in each.set}

    def _jobs(self, points: Iterable[Mapping[str, float]]) -> list[Job]:
        return [self.study.job({**case, **self.settings(point)}) for point in points for case in self.spec.cases]

    def _parameters(self, place: Sequence[float]) -> dict[str, float]:
        return {spec.name: _parameter_value(spec, float(at)) for spec, at in zip(self.spec.parameters, place, strict=True)}

    def _trial(self, parameters: Mapping[str, float], ledger: RunStore) -> Trial:
        records = [ledger[job.key] for job in self._jobs([parameters])]
        for record in records:
            self.observed_kpis.add(record)
        if failures := [record.failure for record in records if record.failure]:
            return Trial(parameters, math.nan, math.inf, failures[0])
        names = [{**record.kpis, **parameters} for record in records]
        values = [self.objective(each) for each in names]
        violation = sum(each.violation(known) for each in self.constraints for known in names)
        return Trial(parameters, float(np.max(values)) if self.spec.over_cases == "max" else fmean(values), violation)

    def _check_names(self) -> None:
        """Raises InputError for names that no run has a KPI for, if any run says which there are."""
        known = {**self.observed_kpis.kpis, **dict.fromkeys(each.name for each in self.spec.parameters)}
        found = [(self.objective, ("minimize",))]
        found += [(side, ("constraints", i)) for i, each in enumerate(self.constraints) for side in (each.left, each.right)]  # type: ignore[misc]
        problems = [
            Problem(text, self.study_file.document.where(path))
            for each, path in found
            if (text := each.unknown_name_problem(known))
        ]
        if problems and self.observed_kpis.runs:
            raise InputError(problems)


def _parameter_value(spec: ParameterSpec, place: float) -> float:
    """Twelve digits are enough, and the same on every machine; bounds are kept."""
    rounded = float(f"{interpolate(place, spec.min, spec.max, spec.scale == 'log'):.12g}")
    return min(max(rounded, spec.min), spec.max)


def _start_parameters(spec: TuneSpec) -> dict[str, float]:
    return {each.name: _parameter_value(each, place) for each, place in zip(spec.parameters, _start_positions(spec), strict=True)}


def _start_positions(spec: TuneSpec) -> list[float]:
    """Where the search begins: the start values, else the middle."""
    return [0.5 if each.start is None else _unit_position(each, each.start) for each in spec.parameters]


def _unit_position(spec: ParameterSpec, value: float) -> float:
    if spec.scale == "log":
        return math.log(value / spec.min) / math.log(spec.max / spec.min)
    return (value - spec.min) / (spec.max - spec.min)


Evaluator = Callable[[Sequence[Sequence[float]]], list[float]]


def _differential_evolution(evaluate: Evaluator, start: Sequence[float], spec: MethodSpec) -> None:
    """R. Storn, K. Price, J. Global Optim. 11 (1997), 341-359: a whole generation side by side; the start is in the first one."""
    from scipy.optimize import differential_evolution
    from scipy.stats import qmc

    generator = np.random.default_rng(spec.seed)
    population = qmc.LatinHypercube(len(start), rng=generator).random(spec.population)
    population[0] = start

    def converged(intermediate_result: Any) -> bool:
        """As SciPy has it, but not as long as points differ only in how bad they are."""
        ranks = intermediate_result.population_energies
        return bool(ranks.max() < _INFEASIBLE_RANK and np.std(ranks) <= _CONVERGENCE_TOLERANCE * abs(np.mean(ranks)))

    differential_evolution(
        lambda places: np.array(evaluate(places.T.tolist())),
        [(0.0, 1.0)] * len(start),
        maxiter=spec.generations,
        init=population,
        rng=generator,
        polish=False,
        vectorized=True,
        updating="deferred",
        callback=converged,
        tol=0.0,
        atol=-1.0,  # never by SciPy's own measure
    )


def _scipy_minimizer(method: str) -> Callable[[Evaluator, Sequence[float], MethodSpec], None]:
    def search(evaluate: Evaluator, start: Sequence[float], spec: MethodSpec) -> None:
        from scipy.optimize import minimize

        options = {"maxfev": spec.evaluations}
        bounds = [(0.0, 1.0)] * len(start)
        minimize(lambda place: evaluate([place.tolist()])[0], start, method=method, bounds=bounds, options=options)

    return search


#: how to search, from a start, within the unit cube
METHODS: Mapping[str, Callable[[Evaluator, Sequence[float], MethodSpec], None]] = {
    "differential_evolution": _differential_evolution,
    "nelder_mead": _scipy_minimizer("Nelder-Mead"),
    "powell": _scipy_minimizer("Powell"),
}
