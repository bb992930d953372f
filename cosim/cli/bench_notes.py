"""Lines of a controller benchmark about each scenario and about entries that are left out."""

from __future__ import annotations

import time
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import click

from ..core.text import count_noun
from . import current_command_line
from .bench_table import print_comparison
from .commands.regress import print_outcome

if TYPE_CHECKING:
    from ..studies.controller_bench.substitution import Omission
    from .bench_trial import TrialResult


class BenchProgress:
    """Headings of the controllers of a benchmark, with the time that the others probably take.

    Args:
        count: number of controllers.
        quiet: print nothing.
    """

    def __init__(self, count: int, quiet: bool) -> None:
        self._count, self._quiet, self._finished, self._began = (
            count,
            quiet,
            -1,
            time.perf_counter(),
        )

    def print_next(self, name: str) -> None:
        """Print the number and the name of the controller that runs next."""
        self._finished += 1
        rest = ""
        if self._finished:
            seconds = (
                (time.perf_counter() - self._began)
                / self._finished
                * (self._count - self._finished)
            )
            rest = (
                f", about {f'{seconds:.0f} s' if seconds < 100 else f'{seconds / 60:.0f} min'} left"
            )
        self._print(f"{name} (controller {self._finished + 1} of {self._count}{rest})")

    def print_costs(self) -> None:
        """Print that the costs are measured now."""
        self._print("measuring the processor time per step")

    def _print(self, text: str) -> None:
        if not self._quiet:
            click.echo(text)


def print_trial(result: TrialResult, candidate: str) -> None:
    """Print a line about a scenario, its problems and what the candidate ignored in it.

    With --verbose also all KPIs.
    """
    if not result.is_applicable:
        _print_not_applicable(result)
        return
    print_outcome(result.outcome)
    is_verbose = current_command_line().verbosity > 0
    if result.outcome.code and result.trial.ignored_settings:
        click.echo(f"        ignored settings: {', '.join(result.trial.ignored_settings)}")
    if (result.outcome.code or is_verbose) and (
        text := settings_text(result.trial.applied_settings)
    ):
        click.echo(f"        settings applied: {text}")
    if is_verbose:
        print_comparison(result.rows(), candidate)


def settings_text(settings: Mapping[str, Mapping[str, Any]]) -> str:
    """Return the values of each variable of the candidate ("landing_time = 5.0").

    Several if its components differ.
    """
    from ..scenario.variable_values import quote_value

    values: dict[str, dict[str, None]] = {}
    for name, value in (item for each in settings.values() for item in each.items()):
        values.setdefault(name, {})[quote_value(value)] = None
    return ", ".join(f"{name} = {' or '.join(texts)}" for name, texts in values.items())


def _print_not_applicable(result: TrialResult) -> None:
    """Print a line that names the first input which the scenario does not feed, and the number of the others."""
    first, *others = result.unfed_inputs
    more = f" (and {count_noun(len(others), 'more input')})" if others else ""
    click.echo(f"n/a     {result.name:<28} not applicable: {first}{more}")


def print_omissions(omissions: Sequence[tuple[str, Omission]], controller: str = "") -> None:
    """Print what is left out of the scenarios: a line of variables and one of KPIs and figures.

    With --verbose, a line for each.

    Args:
        omissions: names of scenarios, and what is left out of each.
        controller: name of the controller, if there are several.
    """
    begin = f"note: {controller}: " if controller else "note: "
    is_verbose = current_command_line().verbosity > 0
    for line in (
        [f"{scenario}: {each}" for scenario, each in omissions]
        if is_verbose
        else summarize_omissions(omissions)
    ):
        click.echo(f"{begin}{line}")


def summarize_omissions(omissions: Sequence[tuple[str, Omission]]) -> list[str]:
    """Return a line of ignored settings and one of KPIs and figures that are left out, each with its number of scenarios."""
    settings = [(scenario, each.lacking) for scenario, each in omissions if not each.entry]
    entries = [
        (scenario, f'{each.entry} without "{each.lacking}"')
        for scenario, each in omissions
        if each.entry
    ]
    headings = {
        "ignored settings, for which the controller has no variable": settings,
        "left out": entries,
    }
    return [
        f"{heading} (number of scenarios): {_count_scenarios(items)}"
        for heading, items in headings.items()
        if items
    ]


def _count_scenarios(items: Iterable[tuple[str, str]]) -> str:
    """Return each text once, with its number of scenarios, from names of scenarios and texts."""
    scenarios: dict[str, set[str]] = {}
    for scenario, text in items:
        scenarios.setdefault(text, set()).add(scenario)
    return ", ".join(f"{text} ({len(names)})" for text, names in scenarios.items())
