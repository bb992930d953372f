"""A map of success as a figure: colour is the share of successes, text says how sure it is."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING, Any

from ...report.figures import style
from .success_map import Cell, SuccessMap
from .success_map_layout import AXIS, PANEL, TICK, Layout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: where a click on a cell leads; empty: nowhere
Link = Callable[[Cell], str]

#: the same lightness for all kinds of colour vision (Nuñez, Anderton, Renslow 2018)
COLOURS = "cividis"
#: a cell is as large as its share, or its interval too, can be read (in)
_READABLE, _ROOMY = (0.3, 0.17), (0.44, 0.34)


def draw_map(map_: SuccessMap, link: Link = lambda cell: "") -> Figure:
    """The map as a matplotlib figure; in SVG files its cells are links."""
    with style():
        return _figure(map_, link)


def _figure(map_: SuccessMap, link: Link) -> Figure:
    from matplotlib.figure import Figure

    layout = Layout(map_)
    rows, columns, _, _ = layout.levels
    figure = Figure(figsize=layout.total)
    grid = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    figure.subplots_adjust(**layout.places)
    for (i, row), (j, column) in product(enumerate(rows), enumerate(columns)):
        _panel(grid[i][j], layout, row, column, link)
    _annotate(figure, grid, layout)
    _scale(figure, layout)
    return figure


def _panel(axes: Axes, layout: Layout, row: Any, column: Any, link: Link) -> None:
    _, _, ys, xs = layout.levels
    for (j, y), (i, x) in product(enumerate(ys), enumerate(xs)):
        _draw_cell(axes, i, j, layout.map_.cell(row, column, y, x), layout.cell, link)
    axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5))
    axes.set_xticks(list(layout.x_ticks), layout.x_ticks.values(), rotation=90 if layout.turned else 0)
    axes.set_yticks(list(layout.y_ticks), layout.y_ticks.values())
    axes.tick_params(length=0, labelsize=TICK)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _draw_cell(axes: Axes, x: int, y: int, cell: Cell, size: tuple[float, float], link: Link) -> None:
    from matplotlib import colormaps
    from matplotlib.patches import Rectangle

    known = bool(cell.runs)
    fill = colormaps[COLOURS](cell.share) if known else "#EEEEEE"
    square = Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=fill, edgecolor="white", linewidth=0.8, url=link(cell) or None)
    axes.add_patch(square)
    if not known or size[0] < _READABLE[0] or size[1] < _READABLE[1]:
        return
    ink = "black" if cell.share > 0.5 else "white"
    roomy = size[0] >= _ROOMY[0] and size[1] >= _ROOMY[1]
    axes.text(x, y + 0.2 * roomy, _percent(cell.share), ha="center", va="center", color=ink, fontsize=7)
    if roomy:
        low, high = cell.interval
        detail = f"{cell.passed}/{len(cell.runs)}\n{100 * low:.0f}–{100 * high:.0f} %"
        axes.text(x, y - 0.19, detail, ha="center", va="center", color=ink, fontsize=4.6, linespacing=1.15)


def _percent(share: float) -> str:
    return "" if math.isnan(share) else f"{100 * share:.0f} %"


def _annotate(figure: Figure, grid: Any, layout: Layout) -> None:
    """Names of the axes, once; labels of panels above and beside them."""
    (x, y), centre = layout.titles, layout.centre
    figure.supxlabel(x, fontsize=AXIS, x=centre[0], y=0.06 / figure.get_figheight())
    figure.supylabel(y, fontsize=AXIS, x=0.06 / figure.get_figwidth(), y=centre[1])
    for axes, text in zip(grid[0], layout.above, strict=False):
        axes.set_title(text, fontsize=PANEL)
    for axes, text in zip(grid[:, -1], layout.beside, strict=False):
        beside = {"rotation": 270, "ha": "left", "va": "center", "weight": "bold", "fontsize": AXIS}
        axes.text(1.02, 0.5, text, transform=axes.transAxes, **beside)


def _scale(figure: Figure, layout: Layout) -> None:
    """The colours of 0 to 100 %, at the right edge."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import PercentFormatter

    axes = figure.add_axes(layout.scale)
    bar = figure.colorbar(ScalarMappable(cmap=COLOURS), cax=axes, format=PercentFormatter(1.0), ticks=[0, 0.5, 1])
    bar.outline.set_visible(False)  # type: ignore[operator]
    axes.tick_params(length=0, labelsize=6)
