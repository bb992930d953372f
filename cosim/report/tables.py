"""Tables in the terminal.

KPIs and checks after a run, and the console for tables of other commands.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TextIO

from ..core.text import escape_control_characters
from ..process.standard_streams import unescaped

if TYPE_CHECKING:
    from rich.text import Text

    from ..results.checks import CheckOutcome, Number

MAX_LINE_WIDTH = 1000  # characters, of output that is not a terminal


def print_kpis(
    kpis: Mapping[str, Number],
    outcomes: Sequence[CheckOutcome] = (),
    units: Mapping[str, str] | None = None,
    file: TextIO | None = None,
    notes: Sequence[str] = (),
) -> None:
    """Print a table of all KPIs with their units and checks; print nothing if there are none.

    It does not use Rich, because importing Rich takes about 5 % of the time of a short run. Colours
    are used only on a terminal without NO_COLOR.

    Args:
        kpis: The values by name.
        outcomes: The outcomes of the scenario's checks; a KPI that was not evaluated is shown
            without a value.
        units: The units by name (see `cosim.results.kpi.kpi_units`).
        file: The output stream; default: standard output.
        notes: Lines below the table, such as the reasons of missing values.
    """
    values = {**kpis, **{o.check["kpi"]: o.value for o in outcomes if o.check["kpi"] not in kpis}}
    if not values:
        return
    file = unescaped(file or sys.stdout)
    plain, coloured = not file.encoding.lower().startswith("utf"), _has_colours(file)
    rows = [("KPI", "value", "unit", "check" if outcomes else "", "")]
    for name, value in values.items():
        checks = [
            (o.limits, _check_mark(o.passed, plain, coloured))
            for o in outcomes
            if o.check["kpi"] == name
        ] or [("", "")]
        cells = (
            escape_control_characters(name),
            format_number(value),
            escape_control_characters((units or {}).get(name, "")),
        )
        rows += [(*(("", "", "") if i else cells), *check) for i, check in enumerate(checks)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [_join_cells(row, widths) for row in rows]
    lines.insert(1, ("-" if plain else "─") * (sum(widths[:4]) + 3 * len(widths)))
    lines += map(escape_control_characters, notes)
    file.write("\n".join((*lines, "")))


def _join_cells(row: Sequence[str], widths: Sequence[int]) -> str:
    name, value, unit, limits, mark = row
    return (
        f"{name:{widths[0]}}   {value:>{widths[1]}}   {unit:{widths[2]}}   {limits:{widths[3]}}   "
        f"{mark}"
    ).rstrip()


def _check_mark(passed: bool, plain: bool, coloured: bool) -> str:
    sign = "" if plain else "✗ "
    word, colour = f"{sign}failed", "1;31"
    if passed:
        word, colour = "ok" if plain else "✓", "32"
    return f"\x1b[{colour}m{word}\x1b[0m" if coloured else word


def _has_colours(file: TextIO) -> bool:
    """Return whether a stream shows colours; see no-color.org and force-color.org."""
    if os.environ.get("NO_COLOR"):
        return False
    return bool(os.environ.get("FORCE_COLOR")) or (
        file.isatty() and os.environ.get("TERM") not in ("dumb", "unknown")
    )


def print_table(
    header: Sequence[str],
    rows: Iterable[Sequence[str | Text]],
    right: Collection[str] | None = None,
) -> None:
    """Print a table and an empty line on standard output.

    Args:
        header: Names of the columns.
        rows: Texts of the cells; a Rich text may have a colour.
        right: Names of the columns that are aligned to the right; None: all but the first one and
            "unit", which are texts.
    """
    from rich import box
    from rich.console import Console
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_edge=False)
    for i, name in enumerate(header):
        is_number = (i > 0 and name != "unit") if right is None else name in right
        justify: Literal["left", "right"] = "right" if is_number else "left"
        table.add_column(cell_text(name), justify=justify, overflow="fold")
    for row in rows:
        table.add_row(*(cell_text(cell) if isinstance(cell, str) else cell for cell in row))
    console = Console(file=unescaped(sys.stdout), highlight=False)
    if not console.is_terminal:
        console.width = MAX_LINE_WIDTH
    console.print(table, "")


def cell_text(text: str) -> str:
    """Return a text for Rich in which neither markup nor control characters have an effect."""
    from rich.markup import escape

    return escape(escape_control_characters(text))


def format_number(value: Number) -> str:
    """Return a value as text: four significant digits, "yes" or "no" for a Boolean, "-" for NaN."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if math.isnan(value):
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
