"""Data of a figure as CSV, read from its curves and bars.

Figure functions, also those of users, only return a matplotlib figure; reading it gives every
figure a CSV file.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..core.csv_text import text_cell
from ..results.files import writing_atomically

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: label of the y axis, name of the curve, x value or name of the bar, y value
DataPoint = tuple[str, str, str | float, float]


def write_figure_data(figure: Figure, path: Path) -> bool:
    """Write the points of all curves and the heights of all bars of `figure` to `path`, a row each.

    The columns are the label of the y axis, the name of the curve, the x value (with the label of
    the x axis as its header) and the y value. Returns False without writing a file if the figure
    has neither curves nor bars.
    """
    rows = [row for axes in figure.axes for row in _curve_points(axes)]
    if not rows:
        return False
    header = ("panel", "curve", figure.axes[-1].get_xlabel() or "x", "value")
    with (
        writing_atomically(path) as temporary,
        temporary.open("w", encoding="utf-8", newline="") as file,
    ):
        lines = (
            [text_cell(cell) if isinstance(cell, str) else cell for cell in row]
            for row in (header, *rows)
        )
        csv.writer(file, lineterminator="\n").writerows(lines)
    return True


def _curve_points(axes: Axes) -> Iterator[DataPoint]:
    """Yield the points of all curves and bars of a panel, except markers without a label and lines across the axes."""
    panel = axes.get_ylabel().replace("\n", " ")
    for line in axes.lines:
        name, in_data_units = str(line.get_label()), line.get_transform() == axes.transData
        is_marker = name.startswith("_") and line.get_linestyle() == "None"
        if in_data_units and not is_marker:
            curve = "" if name.startswith("_") else name
            points = zip(
                np.asarray(line.get_xdata()).tolist(),
                np.asarray(line.get_ydata()).tolist(),
                strict=True,
            )
            yield from ((panel, curve, x, y) for x, y in points)
    yield from _bar_points(axes, panel)


def _bar_points(axes: Axes, panel: str) -> Iterator[DataPoint]:
    from matplotlib.container import BarContainer

    for container in axes.containers:
        if isinstance(container, BarContainer):
            names = [label.get_text().replace("\n", " ") for label in axes.get_xticklabels()]
            curve = str(container.get_label())
            yield from (
                (panel, curve, name, bar.get_height())
                for name, bar in zip(names, container, strict=True)
            )
