"""The table of KPIs and checks that is printed after a run."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TextIO

from ..core.printable_text import escape_control_characters
from ..process.standard_streams import unescaped
from ..results.checks import CheckOutcome, Number

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

MAX_LINE_WIDTH = 1000  # characters, of output that is not a terminal


def print_kpis(
    kpis: Mapping[str, Number],
    outcomes: Sequence[CheckOutcome] = (),
    units: Mapping[str, str] | None = None,
    file: TextIO | None = None,
) -> None:
    """Print a table of all KPIs with their units and checks; print nothing if there are none.

    Colours are used only on a terminal without NO_COLOR. Other output has no line breaks within a row.

    Args:
        kpis: The values by name.
        outcomes: The outcomes of the scenario's checks.
        units: The units by name (see `cosim.results.kpi.kpi_units`).
        file: The output stream; default: standard output.
    """
    if not kpis:
        return
    console = table_console(file)
    console.print(_kpi_table(kpis, outcomes, units or {}, plain=console.options.ascii_only))


def table_console(file: TextIO | None = None, width: int = MAX_LINE_WIDTH) -> Console:
    """Return a console for tables; the cells have to be made by `cell_text`.

    Args:
        file: The output stream; default: standard output.
        width: Characters of a line unless the output is a terminal.
    """
    from rich.console import Console

    console = Console(file=unescaped(file or sys.stdout), highlight=False)
    if not console.is_terminal:
        console.width = width
    return console


def cell_text(text: str) -> str:
    """Return a text for Rich in which neither markup nor control characters have an effect."""
    from rich.markup import escape

    return escape(escape_control_characters(text))


def _kpi_table(kpis: Mapping[str, Number], outcomes: Sequence[CheckOutcome], units: Mapping[str, str], plain: bool) -> Table:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    table.add_column("KPI", overflow="fold")
    table.add_column("value", justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    if outcomes:
        table.add_column("check", no_wrap=True)
        table.add_column("", no_wrap=True)
    for name, value in kpis.items():
        own = [outcome for outcome in outcomes if outcome.check["kpi"] == name]
        limits, marks = (
            "\n".join(outcome.limits for outcome in own),
            "\n".join(_check_mark(outcome.passed, plain) for outcome in own),
        )
        table.add_row(
            cell_text(name), format_number(value), cell_text(units.get(name, "")), *([limits, marks] if outcomes else [])
        )
    return table


def _check_mark(passed: bool, plain: bool) -> str:
    if passed:
        return f"[green]{'ok' if plain else '✓'}[/]"
    return f"[bold red]{'failed' if plain else '✗ failed'}[/]"


def format_number(value: Number) -> str:
    """Return a value as text: four significant digits, "yes" or "no" for a Boolean, "-" for NaN."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "-" if math.isnan(value) else f"{value:.4g}" if isinstance(value, float) else str(value)
