"""Ranking of a candidate and of the scenarios' own controllers by what their role is for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any, Literal

from ...results.checks import evaluate_all_checks
from .score import RunKpis, compare_values, merge_senses


@dataclass(frozen=True)
class ScenarioKpis:
    """KPIs of both controllers in a scenario (None: the run did not reach its end), and the checks of the scenario.

    `is_applicable` is False if the scenario does not feed an input of the candidate. `own_name` is the name of the controller
    that the scenario contains, such as "ar_drone_cascaded". `descriptions` are the meanings of KPI values (see `describe_kpis`),
    `settings` the values that the scenario gives the candidate ("landing_time = 5.0").
    """

    candidate: RunKpis | None
    shipped: RunKpis | None
    checks: Sequence[Mapping[str, Any]]
    is_applicable: bool = True
    own_name: str = ""
    descriptions: Mapping[str, str] = field(default_factory=dict)
    settings: str = ""


@dataclass
class Standing:
    """Achievements of a controller in all scenarios.

    Attributes:
        scenarios: number of scenarios.
        passed: number of scenarios that ended with all checks passed.
        checks: number of checks.
        met: number of checks that passed.
    """

    scenarios: int = 0
    passed: int = 0
    checks: int = 0
    met: int = 0

    def add(self, run: RunKpis | None, checks: Sequence[Mapping[str, Any]]) -> None:
        """Add a scenario."""
        met = sum(
            outcome.passed for outcome in evaluate_all_checks(run.kpis if run else {}, checks)
        )
        self.scenarios += 1
        self.passed += run is not None and met == len(checks)
        self.checks += len(checks)
        self.met += met


@dataclass
class Ranking:
    """Ranking of a candidate against the shipped controller.

    Checks count first: a controller that meets fewer of them ranks below. If both meet the same
    number, the goals of the role decide, the most important one first, by the number of values that
    are better and worse.

    Attributes:
        candidate: achievements of the candidate.
        shipped: those of the shipped controller.
        goals: numbers of better and worse values of the candidate, by the pattern of each goal.
    """

    candidate: Standing = field(default_factory=Standing)
    shipped: Standing = field(default_factory=Standing)
    goals: dict[str, dict[str, int]] = field(default_factory=dict)

    @property
    def verdict(self) -> Literal["above", "equal", "below"]:
        """Place of the candidate relative to the shipped controller."""
        differences = [
            self.candidate.met - self.shipped.met,
            self.candidate.passed - self.shipped.passed,
        ]
        differences += [counts["better"] - counts["worse"] for counts in self.goals.values()]
        first = next((difference for difference in differences if difference), 0)
        return "above" if first > 0 else "below" if first < 0 else "equal"


def rank(scenarios: Sequence[ScenarioKpis], goals: Sequence[str]) -> Ranking:
    """Rank a candidate.

    Args:
        scenarios: the KPIs in all scenarios.
        goals: patterns of the names of KPI values, the most important first.
    """
    ranking = Ranking(goals={goal: {"better": 0, "worse": 0} for goal in goals})
    for each in scenarios:
        ranking.candidate.add(each.candidate, each.checks)
        ranking.shipped.add(each.shipped, each.checks)
        if each.candidate and each.shipped:
            _count_goals(ranking, each.candidate, each.shipped, each.checks)
    return ranking


def _count_goals(
    ranking: Ranking, candidate: RunKpis, shipped: RunKpis, checks: Sequence[Mapping[str, Any]]
) -> None:
    senses = merge_senses(candidate.senses, list(checks))
    for goal, counts in ranking.goals.items():
        for name, value in candidate.kpis.items():
            if fnmatchcase(name, goal) and (
                word := compare_values(value, shipped.kpis.get(name), senses.get(name))
            ):
                counts[word] += 1
