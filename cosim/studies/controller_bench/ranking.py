"""Comparison of a candidate's KPIs with those of other runs, and the ranking that follows."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

from ...core import __version__
from ...core.json_values import is_number, parse_object
from ...results.checks import CheckOutcome, Number, evaluate_all_checks, evaluate_checks
from ...scenario.file_paths import path_in

#: relative difference up to which two values are equal
EQUALITY_TOLERANCE = 0.01


@dataclass(frozen=True)
class RunKpis:
    """KPIs of a finished run, with their units and senses ("lower" or "higher" is better)."""

    kpis: Mapping[str, Number]
    units: Mapping[str, str]
    senses: Mapping[str, str]

    @classmethod
    def read(cls, directory: Path) -> RunKpis | None:
        """Read the KPIs from a folder written by `cosim run`; None if there is no complete run."""
        try:
            kpis, about = (
                parse_object((directory / name).read_text(encoding="utf-8"))
                for name in ("kpis.json", "run.json")
            )
            numbers = {name: math.nan if value is None else value for name, value in kpis.items()}
            units, senses = dict(about["kpi_units"]), dict(about["kpi_senses"])
            return cls(numbers, units, senses) if all(map(is_number, numbers.values())) else None
        except (OSError, ValueError, KeyError, TypeError):
            return None


def is_current(directory: Path, scenario: Path) -> bool:
    """Return whether the run in `directory` is up to date.

    The files of `scenario` and the version of cosim are unchanged.
    """
    try:
        about = parse_object((directory / "run.json").read_text(encoding="utf-8"))
        files = {
            path_in(scenario.parent.resolve(), name): digest
            for name, digest in about["sha256"].items()
        }
        same_files = all(
            sha256(file.read_bytes()).hexdigest() == digest for file, digest in files.items()
        )
        return (
            same_files and scenario.resolve() in files and about["versions"]["cosim"] == __version__
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return False


def compare_values(value: Number | None, other: Number | None, sense: str | None) -> str:
    """Return whether `value` is "better" or "worse" than `other`.

    "" if they are equal or not comparable.

    Args:
        value: value of a KPI; None: missing.
        other: value to compare with; None: missing.
        sense: "lower" or "higher", whichever is better; None: unknown.

    NaN means that an event did not happen; any number is better.
    """
    if value is None or other is None or sense is None or (math.isnan(value) and math.isnan(other)):
        return ""
    if math.isnan(value) or math.isnan(other):
        return "worse" if math.isnan(value) else "better"
    if abs(value - other) <= EQUALITY_TOLERANCE * max(abs(value), abs(other)):
        return ""
    return "better" if (value < other) == (sense == "lower") else "worse"


def merge_senses(declared: Mapping[str, str], checks: list[Mapping[str, Any]]) -> dict[str, str]:
    """Return the sense of each KPI.

    As its function declares it, else derived from its check ("max": lower is better).
    """
    of_checks = {
        check["kpi"]: "lower" if "max" in check else "higher"
        for check in checks
        if ("max" in check) != ("min" in check) or check.get("equals") is True
    }
    return {**of_checks, **declared}


@dataclass(frozen=True)
class KpiComparison:
    """KPI in one scenario.

    Values of the candidate, the shipped controller and the candidate's last run (None: missing).
    """

    name: str
    unit: str
    candidate: Number
    shipped: Number | None
    last: Number | None
    against_shipped: str
    against_last: str
    checks: tuple[CheckOutcome, ...]

    def check_results(self) -> list[dict[str, Any]]:
        """Return the checks as JSON, each with its outcome."""
        return [{**outcome.check, "passed": outcome.passed} for outcome in self.checks]


def compare_kpis(
    candidate: RunKpis,
    shipped: RunKpis | None,
    last: RunKpis | None,
    checks: list[Mapping[str, Any]],
) -> list[KpiComparison]:
    """Compare each KPI of the candidate with those of other runs.

    These are the runs of the shipped controller and the last one of the candidate.
    """
    better = merge_senses(candidate.senses, checks)
    outcomes = evaluate_checks(candidate.kpis, checks)

    def row(name: str, value: Number) -> KpiComparison:
        of_shipped, of_last = (run.kpis.get(name) if run else None for run in (shipped, last))
        against_shipped, against_last = (
            compare_values(value, other, better.get(name)) for other in (of_shipped, of_last)
        )
        checked = tuple(outcome for outcome in outcomes if outcome.check["kpi"] == name)
        return KpiComparison(
            name,
            candidate.units.get(name, ""),
            value,
            of_shipped,
            of_last,
            against_shipped,
            against_last,
            checked,
        )

    return [row(name, value) for name, value in candidate.kpis.items()]


@dataclass(frozen=True)
class ScenarioKpis:
    """KPIs of both controllers in a scenario, and the checks of the scenario.

    Attributes:
        candidate: KPIs of the candidate; None: its run did not reach its end.
        shipped: KPIs of the scenario's own controller; None: its run did not reach its end.
        checks: checks of the scenario.
        is_applicable: False if the scenario does not feed an input of the candidate.
        own_name: name of the scenario's own controller, such as "ar_drone_cascaded".
        descriptions: meanings of KPI values (see `describe_kpis`).
        settings: values that the scenario gives the candidate ("landing_time = 5.0").
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
        first = next(filter(None, differences), 0)
        if first == 0:
            return "equal"
        return "above" if first > 0 else "below"


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
        if each.candidate is None or each.shipped is None:
            continue
        senses = merge_senses(each.candidate.senses, list(each.checks))
        for name, value in each.candidate.kpis.items():
            word = compare_values(value, each.shipped.kpis.get(name), senses.get(name))
            for goal, counts in ranking.goals.items():
                if word and fnmatchcase(name, goal):
                    counts[word] += 1
    return ranking
