"""Figures in a common style, written to files that are reproducible byte by byte.

A scenario names functions `function(result, **arguments) -> matplotlib.figure.Figure`, as it does
for KPIs. They should not use pyplot, which keeps global state and may need a window system.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..results import Result
from ..results.csv_files import text_cell
from ..results.files import writing_atomically
from ..results.kpi import ResultFunction

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: matplotlib settings for a column (3.5 in) of a two-column paper; colours for colour-blind readers
#: (Okabe and Ito 2008)
STYLE: Mapping[Any, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#444444",
    "axes.grid": True,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": (
        "cycler('color', ['0072B2', 'D55E00', '009E73', 'CC79A7', 'E69F00', '56B4E9'])"
    ),
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 8,
    "figure.constrained_layout.use": True,
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
    """Use STYLE in this block instead of the user's own matplotlib settings."""
    from matplotlib import rc_context, rcdefaults, rcParams

    with rc_context():
        rcdefaults()
        rcParams.update(STYLE)
        yield


def draw_figure(
    result: Result, name: str, function: Callable[..., Figure], arguments: Mapping[str, Any]
) -> Figure:
    """Draw a figure in the common style.

    Args:
        result: The result to draw.
        name: The name of the figure, for messages.
        function: The figure function of the scenario.
        arguments: Its keyword arguments.

    Returns:
        The figure with its final layout, by matplotlib's constrained layout unless the function
        sets another one.

    Raises:
        InputError: The result lacks a signal that the function needs.
        ComponentError: The function fails or does not return a matplotlib figure.
    """
    from matplotlib.figure import Figure

    evaluation = ResultFunction(name, function, arguments)
    with figure_style():
        figure = evaluation.evaluate("figure", result)
        if not isinstance(figure, Figure):
            raise evaluation.failure(
                "figure", f"returned {type(figure).__name__}, expected a matplotlib.figure.Figure"
            )
        # laid out once, for all of its files; axes that are not in a grid keep their positions
        engine = figure.get_layout_engine()
        if engine and any(axes.get_subplotspec() for axes in figure.axes):
            engine.execute(figure)
        figure.set_layout_engine("none")
    return figure


def save_figure(figure: Figure, path: Path) -> None:
    """Write a figure as PNG or SVG, according to the suffix of `path`.

    Atomically, without dates and versions.
    """
    with writing_atomically(path) as temporary:
        if path.suffix == ".png":
            from matplotlib.backends.backend_agg import FigureCanvasAgg

            with figure_style():
                cast(Any, FigureCanvasAgg(figure)).print_png(temporary, metadata={"Software": None})
        else:
            temporary.write_text(figure_to_svg(figure), encoding="utf-8", newline="\n")


def figure_to_svg(figure: Figure) -> str:
    """Return a figure as the text of an SVG file, without dates and versions."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    text, dpi = StringIO(), figure.dpi
    with figure_style():
        # the layout is fixed, so `Figure.savefig`, which draws twice, is not needed
        cast(Any, FigureCanvasSVG(figure)).print_svg(text, metadata={"Date": None, "Creator": None})
    figure.set_dpi(dpi)  # print_svg has changed it
    return text.getvalue()


def draw_figures(
    result: Result,
    figures: Iterable[tuple[str, Callable[..., Figure], Mapping[str, Any]]],
    directory: str | Path,
    suffixes: Sequence[str] = (".png",),
    write_data: bool = False,
) -> list[Path]:
    """Draw figures into files and return their paths.

    Args:
        result: The result to draw.
        figures: Name, function and arguments of each figure.
        directory: The folder of the files.
        suffixes: The suffixes of the files of each figure: ".png", ".svg".
        write_data: Also write the data of each figure to NAME.csv.
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


#: label of the y axis, name of the curve, x value or name of the bar, y value
DataPoint = tuple[str, str, str | float, float]


def write_figure_data(figure: Figure, path: Path) -> bool:
    """Write the points of all curves and the heights of all bars of `figure` to `path`, a row each.

    Figure functions, also those of users, only return a matplotlib figure; reading it gives every
    figure a CSV file. The columns are the label of the y axis, the name of the curve, the x value
    (with the label of the x axis as its header) and the y value. Returns False without writing a
    file if the figure has neither curves nor bars.
    """
    points: list[DataPoint] = []
    for axes in figure.axes:
        points += _data_points(axes)
    if not points:
        return False
    with (
        writing_atomically(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        x_label = text_cell(figure.axes[-1].get_xlabel() or "x")
        writer.writerow(("panel", "curve", x_label, "value"))
        for panel, curve, x, y in points:
            x = text_cell(x) if isinstance(x, str) else x
            writer.writerow((text_cell(panel), text_cell(curve), x, y))
    return True


def _data_points(axes: Axes) -> Iterator[DataPoint]:
    """Yield the points of all curves of a panel, and the heights of all bars.

    Markers without a label and lines across the axes are left out.
    """
    from matplotlib.container import BarContainer

    panel = axes.get_ylabel().replace("\n", " ")
    for line in axes.lines:
        name, in_data_units = str(line.get_label()), line.get_transform() == axes.transData
        is_marker = name.startswith("_") and line.get_linestyle() == "None"
        if in_data_units and not is_marker:
            curve = "" if name.startswith("_") else name
            xs, ys = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
            for x, y in zip(xs.tolist(), ys.tolist(), strict=True):
                yield panel, curve, x, y
    for container in axes.containers:
        if isinstance(container, BarContainer):
            names = [label.get_text().replace("\n", " ") for label in axes.get_xticklabels()]
            for name, bar in zip(names, container, strict=True):
                yield panel, str(container.get_label()), name, bar.get_height()
