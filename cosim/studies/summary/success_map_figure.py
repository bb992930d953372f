"""Figure of a success map: colour shows the success rate, text its confidence interval."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING, Any, cast

from ...report.figures import figure_style
from .success_map import MapCell, SuccessMap
from .success_map_layout import AXIS_FONT_SIZE, GAP, PANEL_FONT_SIZE, TICK_FONT_SIZE, MapLayout

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch
    from matplotlib.text import Text

#: returns the address that a click on a cell opens; empty: none
CellLink = Callable[[MapCell], str]

#: perceptually uniform for all kinds of colour vision (Nuñez, Anderton, Renslow 2018)
COLOUR_MAP = "cividis"
#: smallest cells that show their success rate, and its interval too (width and height in inches)
_MIN_CELL_FOR_RATE, _MIN_CELL_FOR_INTERVAL = (0.3, 0.17), (0.44, 0.34)
#: font sizes of rate and interval in the smallest cells that show both, and the largest ratio of
#: those in larger cells to them
_RATE_FONT_SIZE, _INTERVAL_FONT_SIZE, _MAX_FONT_RATIO = 7.0, 5.2, 1.35
#: longest colour bar (in)
_MAX_COLOUR_BAR_LENGTH = 1.6
#: room for labels before the first layout (in)
_FIRST_MARGINS = 1.8, 1.5
#: layouts until the panels have their size, and the tolerance of that size (in)
_MAX_LAYOUTS, _SIZE_TOLERANCE = 4, 0.01


def draw_map(map_: SuccessMap, link: CellLink = lambda _cell: "") -> Figure:
    """Draw a success map as a matplotlib figure.

    Args:
        map_: the map with its cells.
        link: returns the address that a click on a cell opens in SVG files; empty: none.
    """
    with figure_style():
        return _build_figure(map_, link)


def _build_figure(map_: SuccessMap, link: CellLink) -> Figure:
    from matplotlib.figure import Figure

    layout = MapLayout(map_)
    rows, columns, _, _ = layout.levels
    size = [
        panels + margin for panels, margin in zip(layout.panels_size, _FIRST_MARGINS, strict=True)
    ]
    figure = Figure(figsize=(size[0], size[1]), layout="constrained")
    cast(Any, figure.get_layout_engine()).set(w_pad=GAP / 2, h_pad=GAP / 2, wspace=0, hspace=0)
    grid = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    for axes in grid.flat:
        _prepare_panel(axes, layout)
    x_title = _annotate(figure, grid, layout)
    _draw_colour_bar(figure, grid, layout)
    _resize_to_panels(figure, grid, layout)
    x_title.set_x((grid[0, 0].get_position().x0 + grid[0, -1].get_position().x1) / 2)
    # cells do not change the layout, and each layout draws everything
    for (i, row), (j, column) in product(enumerate(rows), enumerate(columns)):
        _draw_cells(grid[i][j], layout, row, column, link)
    return figure


def _draw_cells(axes: Axes, layout: MapLayout, row: Any, column: Any, link: CellLink) -> None:
    _, _, ys, xs = layout.levels
    for (j, y), (i, x) in product(enumerate(ys), enumerate(xs)):
        _draw_cell(axes, i, j, layout.map_.cell(row, column, y, x), layout.cell, link)


def _prepare_panel(axes: Axes, layout: MapLayout) -> None:
    """Set limits, ticks and style of a panel."""
    _, _, ys, xs = layout.levels
    axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5))
    axes.set_xticks(
        list(layout.x_ticks), layout.x_ticks.values(), rotation=90 if layout.rotate_x_labels else 0
    )
    axes.set_yticks(list(layout.y_ticks), layout.y_ticks.values())
    axes.tick_params(length=0, labelsize=TICK_FONT_SIZE)
    axes.grid(visible=False)
    axes.spines[:].set_visible(False)


def _draw_cell(
    axes: Axes, x: int, y: int, cell: MapCell, size: tuple[float, float], link: CellLink
) -> None:
    from matplotlib import colormaps
    from matplotlib.patches import Rectangle

    known = bool(cell.runs)
    fill = colormaps[COLOUR_MAP](cell.success_rate) if known else "#EEEEEE"
    square = Rectangle(
        (x - 0.5, y - 0.5),
        1,
        1,
        facecolor=fill,
        edgecolor="white",
        linewidth=0.8,
        url=link(cell) or None,
    )
    axes.add_artist(square)  # without new limits of the axes, which take most of the time
    if not known or size[0] < _MIN_CELL_FOR_RATE[0] or size[1] < _MIN_CELL_FOR_RATE[1]:
        return
    ink = "black" if cell.success_rate > 0.5 else "white"
    roomy = size[0] >= _MIN_CELL_FOR_INTERVAL[0] and size[1] >= _MIN_CELL_FOR_INTERVAL[1]
    ratio = (
        min(
            size[0] / _MIN_CELL_FOR_INTERVAL[0],
            size[1] / _MIN_CELL_FOR_INTERVAL[1],
            _MAX_FONT_RATIO,
        )
        if roomy
        else 1.0
    )
    style: dict[str, Any] = {"ha": "center", "va": "center", "color": ink}
    axes.text(
        x, y + 0.24 * roomy, _percent(cell.success_rate), fontsize=ratio * _RATE_FONT_SIZE, **style
    )
    if roomy:
        low, high = cell.interval
        detail = f"{cell.passed}/{len(cell.runs)}\n{100 * low:.0f}–{100 * high:.0f} %"
        axes.text(
            x, y - 0.2, detail, fontsize=ratio * _INTERVAL_FONT_SIZE, linespacing=1.15, **style
        )


def _percent(share: float) -> str:
    return "" if math.isnan(share) else f"{100 * share:.0f} %"


def _annotate(figure: Figure, grid: Any, layout: MapLayout) -> Text:
    """Add the titles of both axes, once, and titles above and beside the panels.

    Return the title of the x axis.
    """
    for axes, text in zip(grid[0], layout.column_titles, strict=False):
        axes.set_title(text, fontsize=PANEL_FONT_SIZE)
    for axes, text in zip(grid[:, -1], layout.row_titles, strict=False):
        beside = {
            "rotation": 270,
            "ha": "left",
            "va": "center",
            "weight": "bold",
            "fontsize": AXIS_FONT_SIZE,
        }
        axes.text(1.02, 0.5, text, transform=axes.transAxes, **beside)
    x, y = layout.titles
    figure.supylabel(y, fontsize=AXIS_FONT_SIZE)
    return figure.supxlabel(x, fontsize=AXIS_FONT_SIZE)


def _draw_colour_bar(figure: Figure, grid: Any, layout: MapLayout) -> None:
    """Add the colours of 0 to 100 % at the right edge."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import PercentFormatter

    shrink = min(1.0, _MAX_COLOUR_BAR_LENGTH / layout.panels_size[1])
    bar = figure.colorbar(
        ScalarMappable(cmap=COLOUR_MAP),
        ax=grid,
        format=PercentFormatter(1.0),
        ticks=[0, 0.5, 1],
        shrink=shrink,
        pad=0.02,
    )
    cast("Patch", bar.outline).set_visible(False)
    bar.ax.tick_params(length=0, labelsize=6)


def _resize_to_panels(figure: Figure, grid: Any, layout: MapLayout) -> None:
    """Resize the figure until constrained layout gives each panel its size, then fix the layout."""
    rows, columns = grid.shape
    for _ in range(_MAX_LAYOUTS):
        figure.draw_without_rendering()
        width, height = figure.get_size_inches()
        box = grid[0, 0].get_position()
        missing = layout.panel[0] - box.width * width, layout.panel[1] - box.height * height
        if max(map(abs, missing)) < _SIZE_TOLERANCE:
            break
        figure.set_size_inches(width + columns * missing[0], height + rows * missing[1])
    figure.set_layout_engine("none")
