"""A candidate and a shipped controller in the same scenario, and what is to be said about them."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..studies.regression import Outcome, Regression
from .commands.regress import in_parallel

if TYPE_CHECKING:
    from ..studies.controller_bench.score import Row, Scores


@dataclass(frozen=True)
class Trial:
    """A scenario with the candidate in it, the original, and the folders for the results of both."""

    file: Path
    original: Path
    own: Path
    shipped: Path

    def fly(self) -> Flight:
        """Run the scenario with the candidate."""
        from ..studies.controller_bench.score import Scores

        last = Scores.read(self.own)
        return Flight(self, Regression(self.file, self.own, update=False).outcome(), last)

    def fly_shipped(self) -> None:
        """Run the original, unless what the last run of it has left is what it would be again."""
        from ..studies.controller_bench.score import is_current

        if not is_current(self.shipped, self.original):
            Regression(self.original, self.shipped, update=False).outcome()


@dataclass(frozen=True)
class Flight:
    """The candidate's outcome in a scenario, and what its run before this one had left."""

    trial: Trial
    outcome: Outcome
    last: Scores | None

    @property
    def name(self) -> str:
        return self.trial.file.stem

    def rows(self) -> list[Row]:
        """The KPIs, none when the run did not come to its end."""
        from ..studies.controller_bench.score import Scores, rows

        scores = Scores.read(self.trial.own) if self.outcome.code in (0, 3) else None
        checks = json.loads(self.trial.file.read_text(encoding="utf-8"))["checks"]
        return rows(scores, Scores.read(self.trial.shipped), self.last, checks) if scores else []


def flights(trials: Sequence[Trial], jobs: int) -> Iterator[Flight]:
    """All flights in order, each as soon as it and the shipped controller's have ended; `jobs` run at a time."""
    work: list[Callable[[], Flight | None]] = [each for trial in trials for each in (trial.fly_shipped, trial.fly)]
    return (flight for flight in in_parallel(work, jobs) if flight)
