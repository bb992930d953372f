"""Results in notebooks: a page inside a cell, and figures of signals."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..core.errors import InputError
from ..core.text import count_noun
from ..results import Result
from .figures import STYLE, figure_style, figure_to_svg
from .run_page import draw_scenario_figures, render_report
from .tables import format_number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: height of the report in a cell (CSS pixels)
_HEIGHT = 640
#: largest number of signals in a plot; more cannot be told apart
MAX_SIGNALS = 12


def result_as_html(result: Result) -> str:
    """Return a result for a cell of a notebook.

    The table of KPIs, and the report with figures and replay in a frame.

    The frame has its own origin, so that scripts of the report have no access to the notebook.
    """
    name, failure = (str(result.metadata.get(key) or "") for key in ("name", "failure"))
    rows = f"{count_noun(len(result.time), 'row')} of {count_noun(len(result), 'signal')}"
    lines = [f"<p><b>{html.escape(name or 'Result')}</b>: {rows}</p>"]
    lines += [f"<p>ended early: {html.escape(failure)}</p>"] if failure else []
    if result.kpis:
        lines += [
            "<table><thead><tr><th>KPI</th><th>value</th><th>unit</th><th>check</th></tr></thead>"
            "<tbody>"
        ]
        units = result.metadata.get("kpi_units", {})
        checks = {outcome.check["kpi"]: outcome for outcome in result.checks}
        for kpi, value in result.kpis.items():
            outcome = checks.get(kpi)
            check = f"{outcome.limits} {'✓' if outcome.passed else '✗'}" if outcome else ""
            row = (kpi, format_number(value), units.get(kpi, ""), check)
            cells = "".join(f"<td>{html.escape(cell)}</td>" for cell in row)
            lines.append(f"<tr>{cells}</tr>")
        lines += ["</tbody></table>"]
    if len(result.time):
        page = html.escape(
            render_report(result, result.checks, draw_scenario_figures(result)), quote=True
        )
        style = f"width:100%;height:{_HEIGHT}px;border:1px solid #ccc"
        lines.append(f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{page}"></iframe>')
    return "\n".join(lines)


def plot_signals(result: Result, patterns: Sequence[str]) -> Figure:
    """Draw signals over time, with one diagram for each unit.

    Args:
        result: The result.
        patterns: Names of signals; "*" matches any text.

    Returns:
        The figure, which a notebook shows as SVG.

    Raises:
        InputError: A name matches no numeric signal, or there are more than MAX_SIGNALS.
    """
    from matplotlib.figure import Figure

    class NotebookFigure(Figure):
        """Figure that a notebook shows without pyplot."""

        def _repr_svg_(self) -> str:
            return figure_to_svg(self)

    names = _numeric_signals(result, patterns)
    units = list(dict.fromkeys(result.units.get(name, "") for name in names))
    width, height = STYLE["figure.figsize"]
    with figure_style():
        figure = NotebookFigure(
            figsize=(2 * width, max(height, 1.6 * len(units))), layout="constrained"
        )
        for axes, unit in zip(
            figure.subplots(len(units), sharex=True, squeeze=False)[:, 0], units, strict=True
        ):
            for name in (name for name in names if result.units.get(name, "") == unit):
                axes.plot(result.time, result[name], label=name)
            axes.set_ylabel(unit)
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
        axes.set_xlabel("time (s)")
    return figure


def _numeric_signals(result: Result, patterns: Sequence[str]) -> list[str]:
    names: list[str] = []
    for pattern in patterns:
        if not isinstance(pattern, str):
            raise InputError(f"expected names of signals, found {pattern!r}")
        matches = result.signals(pattern)
        numeric = [name for name in matches if result[name].dtype != object]
        if not matches:
            result[pattern]  # raises the error with the nearest name
        if not numeric:
            raise InputError(f'"{pattern}" is a text, expected a numeric signal')
        names += numeric
    if not 0 < len(different := list(dict.fromkeys(names))) <= MAX_SIGNALS:
        raise InputError(f"expected 1 to {MAX_SIGNALS} signals, found {len(different)}")
    return different
