"""A map of success as a figure: colour is the share of successes, text says how sure it is."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product
from typing import TYPE_CHECKING, Any

from ..report.figures import style
from .maps import Cell, SuccessMap

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: where a click on a cell leads; empty: nowhere
Link = Callable[[Cell], str]

#: the same lightness for all kinds of colour vision (Nuñez, Anderton, Renslow 2018)
COLOURS = "cividis"
#: a figure without its margins is at most so large (in): the page of a two-column paper
_LARGEST = 6.3, 8.2
#: a cell is at most so large (in), and as large as its share, or its interval too, can be read
_CELL, _READABLE, _ROOMY = (0.9, 0.46), (0.3, 0.17), (0.44, 0.34)
_LEFT, _RIGHT, _BOTTOM, _TOP, _GAP = 0.62, 0.78, 0.5, 0.42, 0.12


def draw_map(map_: SuccessMap, link: Link = lambda cell: "") -> Figure:
    """The map as a matplotlib figure; in SVG files its cells are links."""
    with style():
        return _figure(map_, link)


def _figure(map_: SuccessMap, link: Link) -> Figure:
    from matplotlib.figure import Figure

    spec = map_.spec
    rows, columns, ys, xs = (map_.along(name) for name in (spec.rows, spec.columns, spec.y, spec.x))
    size = _cell_size(len(columns) * len(xs), len(rows) * len(ys))
    width = len(columns) * (len(xs) * size[0] + _GAP)
    height = len(rows) * (len(ys) * size[1] + _GAP)
    total = width + _LEFT + _RIGHT, height + _BOTTOM + _TOP
    figure = Figure(figsize=total)
    grid = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    figure.subplots_adjust(
        left=_LEFT / total[0],
        right=1 - _RIGHT / total[0],
        bottom=_BOTTOM / total[1],
        top=1 - _TOP / total[1],
        wspace=_GAP / (len(xs) * size[0]),
        hspace=_GAP / (len(ys) * size[1]),
    )
    for (i, row), (j, column) in product(enumerate(rows), enumerate(columns)):
        _panel(grid[i][j], map_, row, column, size, link)
    _annotate(figure, grid, map_)
    _scale(figure, total)
    return figure


def _cell_size(across: int, down: int) -> tuple[float, float]:
    return min(_CELL[0], _LARGEST[0] / across), min(_CELL[1], _LARGEST[1] / down)


def _panel(axes: Axes, map_: SuccessMap, row: Any, column: Any, size: tuple[float, float], link: Link) -> None:
    ys, xs = map_.along(map_.spec.y), map_.along(map_.spec.x)
    for (j, y), (i, x) in product(enumerate(ys), enumerate(xs)):
        _draw_cell(axes, i, j, map_.cell(row, column, y, x), size, link)
    axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5))
    axes.set_xticks(range(len(xs)), map(_text, xs))
    axes.set_yticks(range(len(ys)), map(_text, ys))
    axes.tick_params(length=0)
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


def _text(label: Any) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)


def _annotate(figure: Figure, grid: Any, map_: SuccessMap) -> None:
    """Names of the axes, once; labels of panels above and beside them."""
    spec = map_.spec
    figure.supxlabel(map_.title(spec.x), fontsize=8, y=0.06 / figure.get_figheight())
    figure.supylabel(map_.title(spec.y), fontsize=8, x=0.06 / figure.get_figwidth())
    if spec.columns:
        for axes, label in zip(grid[0], map_.along(spec.columns), strict=True):
            title = map_.title(spec.columns)
            axes.set_title(f"{title}: {_text(label)}" if title else _text(label), fontsize=7.5)
    if spec.rows:
        for axes, label in zip(grid[:, -1], map_.along(spec.rows), strict=True):
            axes.text(1.02, 0.5, _text(label), transform=axes.transAxes, rotation=270, ha="left", va="center", weight="bold")


def _scale(figure: Figure, total: tuple[float, float]) -> None:
    """The colours of 0 to 100 %, at the right edge."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import PercentFormatter

    height = min(1.6, total[1] - _BOTTOM - _TOP)
    place = (1 - 0.46 / total[0], (_BOTTOM + total[1] - _TOP - height) / 2 / total[1], 0.08 / total[0], height / total[1])
    axes = figure.add_axes(place)
    bar = figure.colorbar(ScalarMappable(cmap=COLOURS), cax=axes, format=PercentFormatter(1.0), ticks=[0, 0.5, 1])
    bar.outline.set_visible(False)  # type: ignore[operator]
    axes.tick_params(length=0, labelsize=6)
