"""Figures into files: one style for all of them, the same bytes for the same result.

A figure is made by a plain function `function(result, **arguments) -> matplotlib.figure.Figure`, named by the scenario just
as a KPI is. Figures are made without pyplot: nothing global is left behind and no window system is asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..results import Result
from ..results.files import writing_atomically
from ..results.kpi import ResultFunction
from .figure_data import write_figure_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: for a column of 3.5 in or a page of 7.16 in of a two-column paper; colours for colour-blind readers (Okabe and Ito 2008)
STYLE: Mapping[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#444444",
    "axes.grid": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": "cycler('color', ['0072B2', 'D55E00', '009E73', 'CC79A7', 'E69F00', '56B4E9'])",
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 8,
    "figure.dpi": 200,
    "figure.figsize": (3.5, 2.6),
    "font.family": "DejaVu Sans",
    "font.size": 8,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "svg.hashsalt": "cosim",
    "xtick.color": "#444444",
    "xtick.labelsize": 7,
    "ytick.color": "#444444",
    "ytick.labelsize": 7,
}


@contextmanager
def figure_style() -> Iterator[None]:
    """Within the block STYLE holds, whatever the user's own matplotlib settings are."""
    from matplotlib import rc_context, rcdefaults, rcParams

    with rc_context():
        rcdefaults()
        rcParams.update(STYLE)
        yield


def draw_figure(result: Result, name: str, function: Callable[..., Figure], arguments: Mapping[str, Any]) -> Figure:
    """The figure `name` in the common style. Raises InputError or ComponentError that name the figure."""
    from matplotlib.figure import Figure

    evaluation = ResultFunction(name, function, arguments)
    with figure_style():
        figure = evaluation.evaluate("figure", result)
    if not isinstance(figure, Figure):
        raise evaluation.failure("figure", f"returned {type(figure).__name__}, expected a matplotlib.figure.Figure")
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG or SVG, whichever the suffix of `path` says: atomically, without dates and versions."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    with figure_style(), writing_atomically(path) as temporary:
        if path.suffix == ".png":
            FigureCanvasAgg(figure).print_png(temporary, metadata={"Software": None})
        else:
            FigureCanvasSVG(figure).print_svg(temporary, metadata={"Date": None, "Creator": None})


def figure_to_svg(figure: Figure) -> str:
    """A figure as the text of an SVG file, without dates and versions."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    text = StringIO()
    with figure_style():
        FigureCanvasSVG(figure).print_svg(text, metadata={"Date": None, "Creator": None})
    return text.getvalue()


def draw_figures(
    result: Result,
    figures: Iterable[tuple[str, Callable[..., Figure], Mapping[str, Any]]],
    directory: str | Path,
    suffixes: Sequence[str] = (".png",),
    write_data: bool = False,
) -> list[Path]:
    """Draw all figures, given as (name, function, arguments), into `directory`/NAME.png (or .svg); returns the files.

    With `numbers`, the numbers behind each are written to NAME.csv beside it.
    """
    files = []
    for name, function, arguments in figures:
        figure = draw_figure(result, name, function, arguments)
        for suffix in suffixes:
            path = Path(directory) / f"{name}{suffix}"
            save_figure(figure, path)
            files.append(path)
        path = Path(directory) / f"{name}.csv"
        if write_data and write_figure_data(figure, path):
            files.append(path)
    return files
