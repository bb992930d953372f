"""Controllers of a role beside those that the scenarios contain: their order, and the page `bench.html`."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from ...core.text import count_noun
from ...core.version import __version__
from ...report.pages import render_page
from ...report.tables import format_number
from ...results.checks import evaluate_all_checks
from ...results.files import writing_atomically
from .ranking import Ranking, ScenarioKpis
from .score import RunKpis

_NOT_APPLICABLE = {"text": "n/a", "failed": False, "limits": ""}


@dataclass(frozen=True)
class BenchedController:
    """Controller, its ranking against those that the scenarios contain, and its costs.

    Attributes:
        name: name of the controller.
        ranking: its ranking.
        scenarios: its KPIs by the name of the scenario.
        goals: patterns of the KPI values that its role is for, the most important first.
        notes: lines about what the scenarios contain and the controller lacks.
        cost: processor time per step (s); NaN: not measured.
        cost_ratio: ratio of `cost` to that of the reference.
    """

    name: str
    ranking: Ranking
    scenarios: Mapping[str, ScenarioKpis]
    goals: Sequence[str]
    notes: Sequence[str]
    cost: float = math.nan
    cost_ratio: float = math.nan


def order(controllers: Sequence[BenchedController]) -> list[BenchedController]:
    """Return the controllers by checks passed, then scenarios passed, then goals; the best first."""

    def key(each: BenchedController) -> list[int]:
        goals = [counts["better"] - counts["worse"] for counts in each.ranking.goals.values()]
        return [each.ranking.candidate.met, each.ranking.candidate.passed, *goals]

    return sorted(controllers, key=key, reverse=True)


def write_bench_page(
    role: str, controllers: Sequence[BenchedController], path: Path, reference: str = "", reference_cost: float = math.nan
) -> None:
    """Write a page with ranks, costs per step, and the checked KPIs and goals in every scenario.

    Args:
        role: the role, or its file.
        controllers: the controllers in the order of their columns; a table ranks them.
        path: file to write.
        reference: name of the controller whose cost is 1; "": the costs were not measured.
        reference_cost: its processor time per step (s).
    """
    text = render_page(
        "bench.html",
        role=Path(role).stem,
        counts=f"{count_noun(len(controllers), 'controller')} in {count_noun(len(controllers[0].scenarios), 'scenario')}",
        reference=reference,
        reference_cost=1e6 * reference_cost,
        controllers=order(controllers),
        columns=[each.name for each in controllers],
        scenarios=[(name, run.own_name, list(_kpi_rows(name, controllers))) for name, run in controllers[0].scenarios.items()],
        version=__version__,
    )
    with writing_atomically(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def _kpi_rows(scenario: str, controllers: Sequence[BenchedController]) -> Iterator[tuple[str, str, list[dict[str, Any]]]]:
    """Yield the name, the unit and the cells of each KPI that is checked or a goal."""
    runs = [each.scenarios[scenario] for each in controllers]
    checked = {check["kpi"] for run in runs for check in run.checks}
    found = [kpis for kpis in (runs[0].shipped, *(run.candidate for run in runs)) if kpis]
    names = dict.fromkeys(name for run in found for name in run.kpis)
    for name in names:
        if name in checked or any(fnmatchcase(name, goal) for goal in controllers[0].goals):
            unit = next((run.units[name] for run in found if name in run.units), "")
            cells = [_cell(name, run.candidate, run.checks) if run.is_applicable else _NOT_APPLICABLE for run in runs]
            yield name, unit, [_cell(name, runs[0].shipped, runs[0].checks), *cells]


def _cell(name: str, run: RunKpis | None, checks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the text of a KPI in a run (None: it failed), and the limits of the checks that failed."""
    if run is None or name not in run.kpis:
        return {"text": "", "failed": run is None, "limits": ""}
    outcomes = evaluate_all_checks(run.kpis, [check for check in checks if check["kpi"] == name])
    failed = [outcome.limits for outcome in outcomes if not outcome.passed]
    return {"text": format_number(run.kpis[name]), "failed": bool(failed), "limits": ", ".join(failed)}
