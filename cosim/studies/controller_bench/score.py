"""KPIs of a candidate beside those of others: which are better and which worse."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...core.version import __version__
from ...results.checks import CheckOutcome, Number, evaluate_checks

#: numbers that differ by less than this share are equal
EQUALITY_TOLERANCE = 0.01


@dataclass(frozen=True)
class RunKpis:
    """What a run left behind, as far as it counts here."""

    kpis: Mapping[str, Number]
    units: Mapping[str, str]
    senses: Mapping[str, str]

    @classmethod
    def read(cls, directory: Path) -> RunKpis | None:
        """Those of the folder that `cosim run` wrote, None where there is no run that came to its end."""
        try:
            kpis, about = (json.loads((directory / name).read_text(encoding="utf-8")) for name in ("kpis.json", "run.json"))
            numbers = {name: math.nan if value is None else value for name, value in kpis.items()}
            return cls(numbers, about["kpi_units"], about["kpi_senses"])
        except (OSError, ValueError, KeyError):
            return None


def is_current(directory: Path, scenario: Path) -> bool:
    """Whether the run in `directory` is what `scenario` would give again: all its files and the version are the same."""
    try:
        about = json.loads((directory / "run.json").read_text(encoding="utf-8"))
        files = {scenario.parent.resolve() / name: digest for name, digest in about["sha256"].items()}
        same_files = all(sha256(file.read_bytes()).hexdigest() == digest for file, digest in files.items())
        return same_files and scenario.resolve() in files and about["versions"]["cosim"] == __version__
    except (OSError, ValueError, KeyError):
        return False


def compare_values(value: Number | None, other: Number | None, sense: str | None) -> str:
    """ "better" or "worse" than `other`, "" where they are the same, where one is missing or nothing says what is better.

    `sense` is "lower" or "higher", what is better. A number is better than NaN, which did not happen.
    """
    if value is None or other is None or sense is None or (math.isnan(value) and math.isnan(other)):
        return ""
    if math.isnan(value) or math.isnan(other):
        return "worse" if math.isnan(value) else "better"
    if abs(value - other) <= EQUALITY_TOLERANCE * max(abs(value), abs(other)):
        return ""
    return "better" if (value < other) == (sense == "lower") else "worse"


def merge_senses(declared: Mapping[str, str], checks: list[Mapping[str, Any]]) -> dict[str, str]:
    """What is better for each KPI: as its function declares, else as its check has it ("max": the lower the better)."""
    of_checks = {
        check["kpi"]: "lower" if "max" in check else "higher"
        for check in checks
        if ("max" in check) != ("min" in check) or check.get("equals") is True
    }
    return {**of_checks, **declared}


@dataclass(frozen=True)
class KpiComparison:
    """One KPI in one scenario: numbers of the candidate, the shipped controller and the candidate's last run (None: no such)."""

    name: str
    unit: str
    candidate: Number
    shipped: Number | None
    last: Number | None
    against_shipped: str
    against_last: str
    checks: tuple[CheckOutcome, ...]


def compare_kpis(
    candidate: RunKpis, shipped: RunKpis | None, last: RunKpis | None, checks: list[Mapping[str, Any]]
) -> list[KpiComparison]:
    """The KPIs of the candidate in their order."""
    better = merge_senses(candidate.senses, checks)
    outcomes = evaluate_checks(candidate.kpis, checks)

    def row(name: str, value: Number) -> KpiComparison:
        of_shipped, of_last = (scores.kpis.get(name) if scores else None for scores in (shipped, last))
        against_shipped, against_last = (compare_values(value, other, better.get(name)) for other in (of_shipped, of_last))
        own = tuple(outcome for outcome in outcomes if outcome.check["kpi"] == name)
        return KpiComparison(name, candidate.units.get(name, ""), value, of_shipped, of_last, against_shipped, against_last, own)

    return [row(name, value) for name, value in candidate.kpis.items()]
