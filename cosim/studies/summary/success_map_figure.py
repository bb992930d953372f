"""A map of success as a figure: colour is the share of successes, text says how sure it is."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING, Any

from ...report.figures import figure_style
from .success_map import MapCell, SuccessMap
from .success_map_layout import AXIS_FONT_SIZE, PANEL_FONT_SIZE, TICK_FONT_SIZE, MapLayout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: where a click on a cell leads; empty: nowhere
CellLink = Callable[[MapCell], str]

#: the same lightness for all kinds of colour vision (Nuñez, Anderton, Renslow 2018)
COLOUR_MAP = "cividis"
#: a cell is as large as its share, or its interval too, can be read (in)
_MIN_CELL_FOR_RATE, _MIN_CELL_FOR_INTERVAL = (0.3, 0.17), (0.44, 0.34)


def draw_map(map_: SuccessMap, link: CellLink = lambda cell: "") -> Figure:
    """The map as a matplotlib figure; in SVG files its cells are links."""
    with figure_style():
        return _build_figure(map_, link)


def _build_figure(map_: SuccessMap, link: CellLink) -> Figure:
    from matplotlib.figure import Figure

    layout = MapLayout(map_)
    rows, columns, _, _ = layout.levels
    figure = Figure(figsize=layout.figure_size)
    grid = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    figure.subplots_adjust(**layout.subplot_parameters)
    for (i, row), (j, column) in product(enumerate(rows), enumerate(columns)):
        _draw_panel(grid[i][j], layout, row, column, link)
    _annotate(figure, grid, layout)
    _draw_colour_bar(figure, layout)
    return figure


def _draw_panel(axes: Axes, layout: MapLayout, row: Any, column: Any, link: CellLink) -> None:
    _, _, ys, xs = layout.levels
    for (j, y), (i, x) in product(enumerate(ys), enumerate(xs)):
        _draw_cell(axes, i, j, layout.map_.cell(row, column, y, x), layout.cell, link)
    axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5))
    axes.set_xticks(list(layout.x_ticks), layout.x_ticks.values(), rotation=90 if layout.rotate_x_labels else 0)
    axes.set_yticks(list(layout.y_ticks), layout.y_ticks.values())
    axes.tick_params(length=0, labelsize=TICK_FONT_SIZE)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _draw_cell(axes: Axes, x: int, y: int, cell: MapCell, size: tuple[float, float], link: CellLink) -> None:
    from matplotlib import colormaps
    from matplotlib.patches import Rectangle

    known = bool(cell.runs)
    fill = colormaps[COLOUR_MAP](cell.success_rate) if known else "#EEEEEE"
    square = Rectangle((x - 0.5, y - 0.5), 1, 1, facecolor=fill, edgecolor="white", linewidth=0.8, url=link(cell) or None)
    axes.add_patch(square)
    if not known or size[0] < _MIN_CELL_FOR_RATE[0] or size[1] < _MIN_CELL_FOR_RATE[1]:
        return
    ink = "black" if cell.success_rate > 0.5 else "white"
    roomy = size[0] >= _MIN_CELL_FOR_INTERVAL[0] and size[1] >= _MIN_CELL_FOR_INTERVAL[1]
    axes.text(x, y + 0.2 * roomy, _percent(cell.success_rate), ha="center", va="center", color=ink, fontsize=7)
    if roomy:
        low, high = cell.interval
        detail = f"{cell.passed}/{len(cell.runs)}\n{100 * low:.0f}–{100 * high:.0f} %"
        axes.text(x, y - 0.19, detail, ha="center", va="center", color=ink, fontsize=4.6, linespacing=1.15)


def _percent(share: float) -> str:
    return "" if math.isnan(share) else f"{100 * share:.0f} %"


def _annotate(figure: Figure, grid: Any, layout: MapLayout) -> None:
    """Names of the axes, once; labels of panels above and beside them."""
    (x, y), centre = layout.titles, layout.centre
    figure.supxlabel(x, fontsize=AXIS_FONT_SIZE, x=centre[0], y=0.06 / figure.get_figheight())
    figure.supylabel(y, fontsize=AXIS_FONT_SIZE, x=0.06 / figure.get_figwidth(), y=centre[1])
    for axes, text in zip(grid[0], layout.column_titles, strict=False):
        axes.set_title(text, fontsize=PANEL_FONT_SIZE)
    for axes, text in zip(grid[:, -1], layout.row_titles, strict=False):
        beside = {"rotation": 270, "ha": "left", "va": "center", "weight": "bold", "fontsize": AXIS_FONT_SIZE}
        axes.text(1.02, 0.5, text, transform=axes.transAxes, **beside)


def _draw_colour_bar(figure: Figure, layout: MapLayout) -> None:
    """The colours of 0 to 100 %, at the right edge."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import PercentFormatter

    axes = figure.add_axes(layout.colour_bar)
    bar = figure.colorbar(ScalarMappable(cmap=COLOUR_MAP), cax=axes, format=PercentFormatter(1.0), ticks=[0, 0.5, 1])
    bar.outline.set_visible(False)  # type: ignore[operator]
    axes.tick_params(length=0, labelsize=6)
