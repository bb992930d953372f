"""A candidate and a shipped controller in the same scenario, and what is to be said about them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..studies.regression import Regression, RegressionOutcome
from .commands.regress import run_in_parallel

if TYPE_CHECKING:
    from ..studies.controller_bench.score import KpiComparison, RunKpis


@dataclass(frozen=True)
class ControllerTrial:
    """A scenario with the candidate in it, the original, and the folders for the results of both."""

    file: Path
    original: Path
    candidate_folder: Path
    shipped_folder: Path

    def run(self) -> TrialResult:
        """Run the scenario with the candidate."""
        from ..studies.controller_bench.score import RunKpis

        last = RunKpis.read(self.candidate_folder)
        return TrialResult(self, Regression(self.file, self.candidate_folder, update=False).run(), last)

    def run_shipped(self) -> None:
        """Run the original, unless what the last run of it has left is what it would be again."""
        from ..studies.controller_bench.score import is_current

        if not is_current(self.shipped_folder, self.original):
            Regression(self.original, self.shipped_folder, update=False).run()


@dataclass(frozen=True)
class TrialResult:
    """The candidate's outcome in a scenario, and what its run before this one had left."""

    trial: ControllerTrial
    outcome: RegressionOutcome
    previous: RunKpis | None

    @property
    def name(self) -> str:
        return self.trial.file.stem

    def rows(self) -> list[KpiComparison]:
        """The KPIs, none when the run did not come to its end."""
        from ..studies.controller_bench.score import RunKpis, compare_kpis

        scores = RunKpis.read(self.trial.candidate_folder) if self.outcome.code in (0, 3) else None
        checks = json.loads(self.trial.file.read_text(encoding="utf-8"))["checks"]
        return compare_kpis(scores, RunKpis.read(self.trial.shipped_folder), self.previous, checks) if scores else []


def run_trials(trials: Sequence[ControllerTrial], jobs: int) -> Iterator[TrialResult]:
    """All flights in order, each as soon as it and the shipped controller's have ended; `jobs` run at a time."""
    work: list[Callable[[], TrialResult | None]] = [each for trial in trials for each in (trial.run_shipped, trial.run)]
    return (flight for flight in run_in_parallel(work, jobs) if flight)
