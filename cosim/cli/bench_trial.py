"""Trials of a candidate and of the shipped controller in the same scenario."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..studies.regression import CommandRunner, Regression, RegressionOutcome
from ..studies.regression_runs import run_in_parallel
from .bench_notes import settings_text, summarize_omissions
from .commands.regress import EXIT_CODE_SEVERITY

if TYPE_CHECKING:
    from ..studies.controller_bench.page import BenchedController
    from ..studies.controller_bench.ranking import Ranking, ScenarioKpis
    from ..studies.controller_bench.score import KpiComparison, RunKpis
    from ..studies.controller_bench.substitution import Omission

#: beginnings of log messages on standard error
LOG_LEVELS = ("DEBUG ", "INFO ", "WARNING ")


@dataclass(frozen=True)
class ControllerTrial:
    """Scenario with the candidate and the original scenario.

    Attributes:
        file: the scenario with the candidate.
        original: the original scenario.
        own_name: name of the controller of the original scenario.
        ignored_settings: variables that the scenario sets and the candidate lacks, such as
            "vtol.landing_time".
        applied_settings: values that the scenario gives the candidate, by component and the
            candidate's own variable.
        kpi_descriptions: meanings of the KPI values (see `describe_kpis`).
        candidate_folder: output directory of the scenario with the candidate.
        shipped_folder: output directory of the original scenario.
        run_command: function that runs commands.
    """

    file: Path
    original: Path
    own_name: str
    ignored_settings: Sequence[str]
    applied_settings: Mapping[str, Mapping[str, Any]]
    kpi_descriptions: Mapping[str, str]
    candidate_folder: Path
    shipped_folder: Path
    run_command: CommandRunner

    def run(self) -> TrialResult:
        """Run the scenario with the candidate and return the result."""
        from ..studies.controller_bench.score import RunKpis

        last = RunKpis.read(self.candidate_folder)
        return TrialResult(
            self, Regression(self.file, self.candidate_folder, False, self.run_command).run(), last
        )

    def run_shipped(self) -> None:
        """Run the original scenario unless the results of its last run are up to date."""
        from ..studies.controller_bench.score import is_current

        if not is_current(self.shipped_folder, self.original):
            Regression(self.original, self.shipped_folder, False, self.run_command).run()


@dataclass(frozen=True)
class TrialResult:
    """Outcome of the candidate in a scenario, and the KPIs of its previous run."""

    trial: ControllerTrial
    outcome: RegressionOutcome
    previous: RunKpis | None

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.trial.file.stem

    @property
    def unfed_inputs(self) -> list[str]:
        """Problems of the inputs of the candidate that the scenario does not feed.

        Empty if it was refused for another reason.
        """
        from ..scenario.wiring import NO_MATCHING_OUTPUT

        problems = [line for line in self.outcome.details if not line.startswith(LOG_LEVELS)]
        if self.outcome.code != 2 or not all(NO_MATCHING_OUTPUT in line for line in problems):
            return []
        return [line[line.index(": input ") + 2 :] for line in problems]

    @property
    def is_applicable(self) -> bool:
        """False if the scenario does not feed an input of the candidate."""
        return not self.unfed_inputs

    @cached_property
    def kpis(self) -> ScenarioKpis:
        """KPIs of the candidate and of the shipped controller, with the checks of the scenario."""
        from ..studies.controller_bench.ranking import ScenarioKpis
        from ..studies.controller_bench.score import RunKpis

        candidate = (
            RunKpis.read(self.trial.candidate_folder) if self.outcome.code in (0, 3) else None
        )
        checks = json.loads(self.trial.file.read_text(encoding="utf-8-sig"))["checks"]
        shipped = RunKpis.read(self.trial.shipped_folder)
        about = (
            self.trial.own_name,
            self.trial.kpi_descriptions,
            settings_text(self.trial.applied_settings),
        )
        return ScenarioKpis(candidate, shipped, checks, self.is_applicable, *about)

    def as_json(self) -> dict[str, Any]:
        """Return the result as JSON."""
        return {
            "name": self.name,
            "applicable": self.is_applicable,
            "code": self.outcome.code,
            "seconds": self.outcome.seconds,
            "problems": self.outcome.details,
            "ignored_settings": list(self.trial.ignored_settings),
            "applied_settings": self.trial.applied_settings,
            "kpis": [_row_as_json(row) for row in self.rows()],
        }

    def rows(self) -> list[KpiComparison]:
        """Return the compared KPIs; none if the run did not reach its end."""
        from ..studies.controller_bench.score import compare_kpis

        candidate, shipped, checks = self.kpis.candidate, self.kpis.shipped, list(self.kpis.checks)
        return compare_kpis(candidate, shipped, self.previous, checks) if candidate else []


def _row_as_json(row: KpiComparison) -> dict[str, Any]:
    checks = [{**outcome.check, "passed": outcome.passed} for outcome in row.checks]
    return {**asdict(row), "checks": checks}


def run_trials(trials: Sequence[ControllerTrial], jobs: int) -> Iterator[TrialResult]:
    """Run all trials, `jobs` at a time.

    Yield the results in order, as soon as both controllers have run.
    """
    work: list[Callable[[], TrialResult | None]] = [
        each for trial in trials for each in (trial.run_shipped, trial.run)
    ]
    return (result for result in run_in_parallel(work, jobs) if result)


@dataclass(frozen=True)
class ControllerTrials:
    """Results of a controller in all scenarios, what its preparation returned, and its ranking."""

    source: str
    name: str
    prepared: Mapping[str, Any]
    results: Sequence[TrialResult]
    ranking: Ranking

    @property
    def exit_code(self) -> int:
        """The most severe exit code of the applicable scenarios; 2 if there is none."""
        codes = [result.outcome.code for result in self.results if result.is_applicable]
        return min(codes, key=EXIT_CODE_SEVERITY.index, default=2)

    @property
    def omissions(self) -> list[tuple[str, Omission]]:
        """Names of scenarios, and what is left out of each."""
        from ..studies.controller_bench.substitution import Omission

        found = self.prepared["omissions"]
        return [
            (each["scenario"], Omission(each["entry"], each["variable"], each["lacking"]))
            for each in found
        ]

    def first_finished(self) -> Mapping[str, str] | None:
        """Return the first scenario that the controller ran to its end, with all its inputs fed.

        None if there is none.
        """
        scenarios = zip(self.prepared["scenarios"], self.results, strict=True)
        return next(
            (
                each
                for each, result in scenarios
                if result.is_applicable and result.outcome.code in (0, 3)
            ),
            None,
        )

    def as_json(self) -> dict[str, Any]:
        """Return ranking, scenarios and notes as JSON."""
        scenarios = [result.as_json() for result in self.results]
        notes = [f"{scenario}: {each}" for scenario, each in self.omissions]
        summary = {**asdict(self.ranking), "verdict": self.ranking.verdict}
        return {"candidate": self.name, "ranking": summary, "scenarios": scenarios, "notes": notes}

    def as_benched(
        self, cost: float = math.nan, reference_cost: float = math.nan
    ) -> BenchedController:
        """Return the controller as the page shows it; costs in s per step."""
        from ..studies.controller_bench.page import BenchedController

        kpis = {result.name: result.kpis for result in self.results}
        notes, goals = summarize_omissions(self.omissions), tuple(self.prepared["goals"])
        return BenchedController(
            self.name, self.ranking, kpis, goals, notes, cost, cost / reference_cost
        )
