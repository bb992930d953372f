"""Controllers of a role beside those that the scenarios contain: order, and page `bench.html`.

Descriptions of KPI values are those of the docstrings of their functions, which are parsed but not
executed.
"""

import ast
import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

from ...core import __version__
from ...core.text import count_noun
from ...report.pages import render_page
from ...report.tables import format_number
from ...results.checks import CheckOutcome, Number, evaluate_all_checks
from ...results.files import write_file
from ...scenario.evaluation_schema import FunctionSpec
from ...scenario.function_definitions import function_definition
from ...scenario.named_functions import definition_problem
from .ranking import Ranking, RunKpis, ScenarioKpis

_NOT_APPLICABLE: dict[str, Any] = {"text": "n/a", "failed": False, "limits": ""}


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
    """Return the controllers by checks passed, then scenarios passed, then goals.

    The best first.
    """

    def key(each: BenchedController) -> list[int]:
        goals = [counts["better"] - counts["worse"] for counts in each.ranking.goals.values()]
        return [each.ranking.candidate.met, each.ranking.candidate.passed, *goals]

    return sorted(controllers, key=key, reverse=True)


def have_different_totals(controllers: Iterable[BenchedController]) -> bool:
    """Return whether scenarios or checks count for some controllers only.

    Some are not applicable, or their KPI is left out.
    """
    standings = [each.ranking.candidate for each in controllers]
    return len({(standing.scenarios, standing.checks) for standing in standings}) > 1


def write_bench_page(
    role: str,
    controllers: Sequence[BenchedController],
    path: Path,
    reference: str = "",
    reference_cost: float = math.nan,
) -> None:
    """Write a page with ranks, costs per step, and the checked KPIs and goals in every scenario.

    Args:
        role: the role, or its file.
        controllers: the controllers in the order of their columns; a table ranks them.
        path: file to write.
        reference: name of the controller whose cost is 1; "": the costs were not measured.
        reference_cost: its processor time per step (s).
    """
    scenarios = []
    # different meanings of each KPI by its name without an index, as keys of a dict
    meanings: dict[str, dict[str, None]] = {}
    for name, run in controllers[0].scenarios.items():
        rows = list(_kpi_rows(name, controllers))
        for row in rows:
            if row.meaning:
                meanings.setdefault(row.name.partition("[")[0], {})[row.meaning] = None
        scenarios.append((name, run.own_name, _settings(name, controllers), rows))
    text = render_page(
        "bench.html",
        role=Path(role).stem,
        counts=(
            f"{count_noun(len(controllers), 'controller')} in "
            f"{count_noun(len(controllers[0].scenarios), 'scenario')}"
        ),
        reference=reference,
        reference_cost=1e6 * reference_cost,
        controllers=order(controllers),
        different_totals=have_different_totals(controllers),
        columns=[each.name for each in controllers],
        scenarios=scenarios,
        meanings=meanings,
        version=__version__,
    )
    write_file(path, text)


def _settings(scenario: str, controllers: Sequence[BenchedController]) -> dict[str, list[str]]:
    """Return the names of the controllers by the settings that the scenario gives them."""
    names: dict[str, list[str]] = {}
    for each in controllers:
        if text := each.scenarios[scenario].settings:
            names.setdefault(text, []).append(each.name)
    return names


class KpiRow(NamedTuple):
    """Row of a scenario's table.

    Attributes:
        name: name of the KPI value.
        unit: its unit.
        meaning: its description; "": unknown.
        limits: limits of its checks, such as "max 0.1"; "": it is not checked.
        cells: text, `failed` and `limits` of the failed checks, of the scenario's own controller
            and of each controller.
    """

    name: str
    unit: str
    meaning: str
    limits: str
    cells: Sequence[Mapping[str, Any]]


def _kpi_rows(scenario: str, controllers: Sequence[BenchedController]) -> Iterator[KpiRow]:
    """Yield a row for each KPI that is checked or a goal."""
    runs = [each.scenarios[scenario] for each in controllers]
    checks = list(chain.from_iterable(run.checks for run in runs))
    found = list(filter(None, [runs[0].shipped, *(run.candidate for run in runs)]))
    for name in dict.fromkeys(chain.from_iterable(run.kpis for run in found)):
        limits = ", ".join(dict.fromkeys(outcome.limits for outcome in _outcomes(name, {}, checks)))
        is_goal = any(fnmatchcase(name, goal) for goal in controllers[0].goals)
        if not limits and not is_goal:
            continue
        unit = next((run.units[name] for run in found if name in run.units), "")
        meanings = (kpi_description(name, run.descriptions) for run in runs)
        cells = [_cell(name, runs[0].shipped, runs[0].checks)]
        for run in runs:
            found_cell = _cell(name, run.candidate, run.checks)
            cells.append(found_cell if run.is_applicable else _NOT_APPLICABLE)
        yield KpiRow(name, unit, next(filter(None, meanings), ""), limits, cells)


def _cell(name: str, run: RunKpis | None, checks: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the text of a KPI in a run (None: it failed), and the limits of failed checks."""
    if run is None or name not in run.kpis:
        return {"text": "", "failed": run is None, "limits": ""}
    failed = [outcome.limits for outcome in _outcomes(name, run.kpis, checks) if not outcome.passed]
    return {
        "text": format_number(run.kpis[name]),
        "failed": bool(failed),
        "limits": ", ".join(failed),
    }


def _outcomes(
    name: str, kpis: Mapping[str, Number], checks: Sequence[Mapping[str, Any]]
) -> list[CheckOutcome]:
    """Return the outcomes of the checks of a KPI."""
    return evaluate_all_checks(kpis, [check for check in checks if check["kpi"] == name])


#: item of a docstring's list of values, such as "- `time[1]`, `time[2]`, ...: time of each (s)",
#: with its continuation lines
_ITEM = re.compile(
    r"^ *- ((?:`[\w\[\]]+`(?:, )?)+)(?:\.\.\.)?: (.+(?:\n +(?!- )\S.*)*)", re.MULTILINE
)
_NAME = re.compile(r"`(\w+)")


def describe_kpis(kpis: Iterable[Mapping[str, Any]], folder: Path) -> dict[str, str]:
    """Return the meaning of the KPI values of a scenario by name without indices.

    A KPI's own name has the first line of the docstring and the arguments, for values that the
    docstring does not list.

    Args:
        kpis: the KPIs as in the scenario.
        folder: folder from which the paths of their functions start.
    """
    found: dict[str, str] = {}
    for spec in map(FunctionSpec.model_validate, kpis):
        text = (
            ""
            if definition_problem(spec, folder)
            else ast.get_docstring(function_definition(spec, folder)) or ""
        )
        for names, meaning in _ITEM.findall(text):
            for value in _NAME.findall(names):
                found[f"{spec.name}.{value}"] = " ".join(meaning.replace("`", "").split())
        if text:
            # such as "the mean of the error over time (signal uav.z, start 15.0)"
            line = text.partition("\n")[0].replace("`", "")
            line = re.sub(r"^(Return|Evaluate) ", "", line).rstrip(".")
            settings = ", ".join(f"{name} {value}" for name, value in spec.arguments.items())
            found[spec.name] = f"{line} ({settings})" if settings else line
    return found


def kpi_description(name: str, descriptions: Mapping[str, str]) -> str:
    """Return the meaning of a KPI value such as "waypoints.time[1]"; "" if it is not known."""
    base = name.partition("[")[0]
    return descriptions.get(base) or descriptions.get(base.partition(".")[0], "")
