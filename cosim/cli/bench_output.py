"""Output of `cosim bench-controller`: progress, outcome of each trial, ranking and tables."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ..core.text import count_noun
from ..report.tables import format_number, print_table
from . import current_command_line
from .messages import print_outcome
from .study_options import format_duration

if TYPE_CHECKING:
    from rich.text import Text

    from ..results.checks import Number
    from ..studies.controller_bench.page import BenchedController
    from ..studies.controller_bench.ranking import KpiComparison, Ranking
    from ..studies.controller_bench.substitution import Omission
    from ..studies.controller_bench.trials import TrialResult

#: heading of the values of the controller that a scenario contains
OWN_CONTROLLER = "scenario's own"


def print_heading(name: str, finished: int, count: int, began: float) -> None:
    """Print the name of the controller that runs next, and the time that is probably left.

    Args:
        name: name of the controller.
        finished: number of controllers before it.
        count: number of all controllers.
        began: `time.perf_counter()` before the first one (s).
    """
    rest = ""
    if finished:
        seconds = (time.perf_counter() - began) / finished * (count - finished)
        rest = f", about {format_duration(seconds)} left"
    click.echo(f"{name} (controller {finished + 1} of {count}{rest})")


def print_trial(result: TrialResult, candidate: str) -> None:
    """Print a line about a scenario, its problems and what the candidate ignored in it.

    With --verbose also all KPIs.
    """
    from ..studies.controller_bench.trials import settings_text

    if not result.is_applicable:
        first, *others = result.unfed_inputs
        more = f" (and {count_noun(len(others), 'more input')})" if others else ""
        click.echo(f"n/a     {result.name:<28} not applicable: {first}{more}")
        return
    print_outcome(result.outcome)
    is_verbose = current_command_line().verbosity > 0
    scenario = result.trial.scenario
    if result.outcome.code and scenario["ignored_settings"]:
        click.echo(f"        ignored settings: {', '.join(scenario['ignored_settings'])}")
    applied = settings_text(scenario["applied_settings"])
    if applied and (result.outcome.code or is_verbose):
        click.echo(f"        settings applied: {applied}")
    if is_verbose:
        _print_comparison(result.rows(), candidate)


def print_omissions(omissions: Sequence[tuple[str, Omission]], controller: str = "") -> None:
    """Print what is left out of the scenarios: a line of variables and one of KPIs and figures.

    With --verbose, a line for each.

    Args:
        omissions: names of scenarios, and what is left out of each.
        controller: name of the controller, if there are several.
    """
    from ..studies.controller_bench.trials import summarize_omissions

    begin = f"note: {controller}: " if controller else "note: "
    lines = summarize_omissions(omissions)
    if current_command_line().verbosity > 0:
        lines = [f"{scenario}: {each}" for scenario, each in omissions]
    for line in lines:
        click.echo(f"{begin}{line}")


def print_ranking(ranking: Ranking, candidate: str) -> None:
    """Print the achievements of a candidate and of the scenarios' own controllers.

    The better one comes first.
    """
    if not ranking.candidate.scenarios:
        click.echo(f"\nno scenario feeds all inputs of {candidate}")
        return
    standings = {candidate: ranking.candidate, OWN_CONTROLLER: ranking.shipped}
    names = list(standings) if ranking.verdict == "above" else list(standings)[::-1]
    width = max(map(len, names))
    click.echo()
    for place, name in enumerate(names, 1):
        found = standings[name]
        checks = f"{found.met} of {count_noun(found.checks, 'check')} passed"
        place = 1 if ranking.verdict == "equal" else place
        click.echo(
            f"{place}. {name:{width}}  {found.passed} of {count_noun(found.scenarios, 'scenario')} "
            f"passed, {checks}"
        )
    goals = [
        f"{goal} {counts['better']} better, {counts['worse']} worse"
        for goal, counts in ranking.goals.items()
        if any(counts.values())
    ]
    words = {"above": "is better than", "equal": "equals", "below": "is worse than"}
    verdict = f"{candidate} {words[ranking.verdict]} the scenarios' own controllers"
    click.echo(f"{verdict} ({'; '.join(goals)})" if goals else verdict)


def print_side_by_side(controllers: Sequence[BenchedController], reference: str) -> None:
    """Print a line per controller: scenarios passed, checks passed and costs per step.

    Below the table what orders them.

    Args:
        controllers: the controllers, the best first.
        reference: name of the controller whose costs are 1; "": the costs were not measured.
    """
    from ..studies.controller_bench.page import have_different_totals

    rows = []
    for each in controllers:
        found = each.ranking.candidate
        rows.append(
            [
                each.name,
                f"{found.passed} of {found.scenarios}",
                f"{found.met} of {found.checks}",
                _format_cost(1e6 * each.cost),
                _format_cost(each.cost_ratio),
            ]
        )
    click.echo()
    print_table(["controller", "scenarios", "checks", "cost (us)", "ratio"], rows)
    click.echo("order: passed checks, then passed scenarios, then the goals of the role")
    if have_different_totals(controllers):
        click.echo(
            "the totals differ: scenarios that are not applicable (n/a) and checks of KPIs that "
            "are left out do not count"
        )
    click.echo(
        f"cost: smallest processor time per step; ratio: to {reference}"
        if reference
        else "the costs were not measured"
    )


def _format_cost(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.3g}"


def _print_comparison(rows: Sequence[KpiComparison], candidate: str) -> None:
    """Print one line per KPI.

    Values of the candidate, the scenario's own controller and the last run, verdicts and checks.

    Args:
        rows: the KPIs; without any, nothing is printed.
        candidate: name of the candidate.
    """
    from rich.text import Text

    if not rows:
        return

    def verdict_cell(verdict: str) -> Text:
        return Text(verdict, style={"better": "green", "worse": "red"}.get(verdict, ""))

    with_last = any(row.last is not None for row in rows)
    with_checks = any(row.checks for row in rows)
    header = ["KPI", "unit", candidate, OWN_CONTROLLER, ""]
    header += ["last run", ""] if with_last else []
    header += ["check"] if with_checks else []
    table: list[list[str | Text]] = []
    for row in rows:
        cells: list[str | Text] = [row.name, row.unit]
        cells += [_format_value(row.candidate), _format_value(row.shipped)]
        cells.append(verdict_cell(row.against_shipped))
        cells += [_format_value(row.last), verdict_cell(row.against_last)] if with_last else []
        if with_checks:
            checks = []
            for outcome in row.checks:
                word, style = ("passed", "green") if outcome.passed else ("failed", "bold red")
                checks.append(Text(f"{outcome.limits} {word}", style=style))
            cells.append(Text(", ").join(checks))
        table.append(cells)
    print_table(header, table, right=(candidate, OWN_CONTROLLER, "last run"))


def _format_value(value: Number | None) -> str:
    return "" if value is None else format_number(value)
