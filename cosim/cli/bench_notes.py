"""Lines of a controller benchmark about each scenario and about entries that are left out."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import click

from ..core.text import count_noun
from . import current_command_line
from .bench_table import print_comparison
from .commands.regress import print_outcome

if TYPE_CHECKING:
    from ..studies.controller_bench.substitution import Omission
    from .bench_trial import TrialResult


def print_trial(result: TrialResult, candidate: str) -> None:
    """Print a line about a scenario and its problems; with --verbose also all KPIs."""
    if not result.is_applicable:
        _print_not_applicable(result)
        return
    print_outcome(result.outcome)
    if current_command_line().verbosity > 0:
        print_comparison(result.rows(), candidate)


def _print_not_applicable(result: TrialResult) -> None:
    """Print a line that names the first input which the scenario does not feed, and the number of the others."""
    first, *others = result.unfed_inputs
    more = f" (and {count_noun(len(others), 'more input')})" if others else ""
    click.echo(f"n/a     {result.name:<28} not applicable: {first}{more}")


def print_omissions(omissions: Sequence[tuple[str, Omission]]) -> None:
    """Print what is left out of the scenarios: a line of variables and one of KPIs and figures; with --verbose, a line for each.

    Args:
        omissions: names of scenarios, and what is left out of each.
    """
    if not omissions:
        return
    click.echo()
    if current_command_line().verbosity > 0:
        for scenario, each in omissions:
            click.echo(f"note: {scenario}: {each}")
        return
    names = [(scenario, each.entry, each.variable.partition(".")[2]) for scenario, each in omissions]
    names = [(scenario, each.entry, each.variable.partition(".")[2]) for scenario, each in omissions]
    variables = [(scenario, name) for scenario, entry, name in names if not entry]
    entries = [(scenario, f'{entry} without "{name}"') for scenario, entry, name in names if entry]
    for heading, items in (("variables that the controller lacks", variables), ("left out", entries)):
        if items:
            click.echo(f"note: {heading} (number of scenarios): {_count_scenarios(items)}")


def _count_scenarios(items: Iterable[tuple[str, str]]) -> str:
    """Return each text once, with its number of scenarios, from names of scenarios and texts."""
    scenarios: dict[str, set[str]] = {}
    for scenario, text in items:
        scenarios.setdefault(text, set()).add(scenario)
    return ", ".join(f"{text} ({len(names)})" for text, names in scenarios.items())
