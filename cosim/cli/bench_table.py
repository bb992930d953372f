"""Table of a candidate's KPIs and those of the runs it is compared with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import click

from ..core.text import count_noun
from ..report.tables import cell_text, format_number, table_console

if TYPE_CHECKING:
    from ..results.checks import Number
    from ..studies.controller_bench.page import BenchedController
    from ..studies.controller_bench.ranking import Ranking
    from ..studies.controller_bench.score import KpiComparison

#: heading of the values of the controller that a scenario contains
OWN_CONTROLLER = "scenario's own"
_COLOURS = {"better": "[green]better[/]", "worse": "[red]worse[/]", "": ""}


def print_ranking(ranking: Ranking, candidate: str) -> None:
    """Print the achievements of a candidate and of the scenarios' own controllers, the better one first."""
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
    from rich import box
    from rich.table import Table

    from ..studies.controller_bench.page import have_different_totals

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column("controller", overflow="fold")
    for header in ("scenarios", "checks", "cost (us)", "ratio"):
        table.add_column(header, justify="right")
    for each in controllers:
        found = each.ranking.candidate
        counts = (f"{found.passed} of {found.scenarios}", f"{found.met} of {found.checks}")
        costs = (
            "-" if math.isnan(value) else f"{value:.3g}"
            for value in (1e6 * each.cost, each.cost_ratio)
        )
        table.add_row(cell_text(each.name), *counts, *costs)
    click.echo()
    table_console().print(table)
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


def print_comparison(rows: Sequence[KpiComparison], candidate: str) -> None:
    """Print one line per KPI.

    Values of the candidate, the scenario's own controller and the last run, verdicts and checks.

    Args:
        rows: the KPIs; without any, nothing is printed.
        candidate: name of the candidate.
    """
    from rich import box
    from rich.table import Table

    if not rows:
        return
    with_last, with_checks = (
        any(row.last is not None for row in rows),
        any(row.checks for row in rows),
    )
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column("KPI", overflow="fold")
    for header in (
        "unit",
        candidate,
        OWN_CONTROLLER,
        "",
        *(("last run", "") if with_last else ()),
        *(("check",) if with_checks else ()),
    ):
        table.add_column(
            cell_text(header),
            justify="right" if header in (candidate, OWN_CONTROLLER, "last run") else "left",
            overflow="fold",
        )
    for row in rows:
        cells = [row.name, row.unit, _format_value(row.candidate), _format_value(row.shipped)]
        last = [_format_value(row.last), _COLOURS[row.against_last]] if with_last else []
        table.add_row(
            *map(cell_text, cells),
            _COLOURS[row.against_shipped],
            *last,
            *([_format_checks(row)] if with_checks else []),
        )
    table_console().print(table)


def _format_value(value: Number | None) -> str:
    return "" if value is None else format_number(value)


def _format_checks(row: KpiComparison) -> str:
    words = (
        "[green]{} passed[/]" if outcome.passed else "[bold red]{} failed[/]"
        for outcome in row.checks
    )
    return ", ".join(
        word.format(outcome.limits) for word, outcome in zip(words, row.checks, strict=True)
    )
