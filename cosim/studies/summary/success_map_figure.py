"""Figure of a success map: colour shows the success rate, text its confidence interval.

Labels are wrapped to fit into cells and panels. Lengths are in inches, font sizes in points.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import product
from typing import TYPE_CHECKING, Any, cast

from ...report.figures import figure_style
from .success_map import MapCell, SuccessMap

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


@figure_style()
def draw_map(map_: SuccessMap, link: CellLink = lambda _cell: "") -> Figure:
    """Draw a success map as a matplotlib figure.

    Args:
        map_: the map with its cells.
        link: returns the address that a click on a cell opens in SVG files; empty: none.
    """
    from matplotlib.figure import Figure

    layout = MapLayout(map_)
    rows, columns, ys, xs = layout.levels
    (width, height), (width_margin, height_margin) = layout.panels_size, _FIRST_MARGINS
    size = (width + width_margin, height + height_margin)
    figure = Figure(figsize=size, layout="constrained")
    cast(Any, figure.get_layout_engine()).set(w_pad=GAP / 2, h_pad=GAP / 2, wspace=0, hspace=0)
    grid = figure.subplots(len(rows), len(columns), sharex=True, sharey=True, squeeze=False)
    for axes in grid.flat:
        axes.set(xlim=(-0.5, len(xs) - 0.5), ylim=(-0.5, len(ys) - 0.5))
        rotation = 90 if layout.rotate_x_labels else 0
        axes.set_xticks(list(layout.x_ticks), layout.x_ticks.values(), rotation=rotation)
        axes.set_yticks(list(layout.y_ticks), layout.y_ticks.values())
        axes.tick_params(length=0, labelsize=TICK_FONT_SIZE)
        axes.grid(visible=False)
        axes.spines[:].set_visible(False)
    x_title = _annotate(figure, grid, layout)
    _draw_colour_bar(figure, grid, layout)
    _resize_to_panels(figure, grid, layout)
    x_title.set_x((grid[0, 0].get_position().x0 + grid[0, -1].get_position().x1) / 2)
    # cells do not change the layout, and each layout draws everything
    for (i, row), (j, column) in product(enumerate(rows), enumerate(columns)):
        for (y, y_label), (x, x_label) in product(enumerate(ys), enumerate(xs)):
            cell = map_.cell(row, column, y_label, x_label)
            _draw_cell(grid[i][j], x, y, cell, layout.cell, link)
    return figure


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
    ratio = 1.0
    if roomy:
        width, height = _MIN_CELL_FOR_INTERVAL
        ratio = min(size[0] / width, size[1] / height, _MAX_FONT_RATIO)
    style: dict[str, Any] = {"ha": "center", "va": "center", "color": ink}
    rate = f"{100 * cell.success_rate:.0f} %"
    axes.text(x, y + 0.24 * roomy, rate, fontsize=ratio * _RATE_FONT_SIZE, **style)
    if roomy:
        low, high = cell.interval
        detail = f"{cell.passed}/{len(cell.runs)}\n{100 * low:.0f}–{100 * high:.0f} %"
        axes.text(
            x, y - 0.2, detail, fontsize=ratio * _INTERVAL_FONT_SIZE, linespacing=1.15, **style
        )


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


#: font sizes of tick labels, titles of panels and titles of axes
TICK_FONT_SIZE, PANEL_FONT_SIZE, AXIS_FONT_SIZE = 7.0, 7.5, 8.0
#: distance between panels
GAP = 0.12
#: largest size of all panels together: the page of a two-column paper
_MAX_SIZE = 6.3, 8.2
_MAX_CELL_SIZE = 0.9, 0.46
#: smallest distance between two labels
_PAD = 0.06
#: length by which the titles of the axes x and y may exceed the panels; the margins have at least
#: this size
_TITLE_EXCESS = 0.6, 0.4
#: safety factor of the number of characters per line estimated from their average width
_WIDTH_VARIATION = 1.3


@dataclass(frozen=True)
class MapLayout:
    """Sizes and labels of a success map's figure.

    Margins are left to matplotlib's constrained layout.
    """

    map_: SuccessMap

    @cached_property
    def levels(self) -> tuple[Sequence[Any], Sequence[Any], Sequence[Any], Sequence[Any]]:
        """Labels of the levels along the rows of panels, the columns of panels, y and x."""
        spec, labels = self.map_.spec, self.map_.axis_labels
        return labels(spec.rows), labels(spec.columns), labels(spec.y), labels(spec.x)

    @cached_property
    def cell(self) -> tuple[float, float]:
        """Width and height of a cell."""
        rows, columns, ys, xs = map(len, self.levels)
        return min(_MAX_CELL_SIZE[0], _MAX_SIZE[0] / (columns * xs)), min(
            _MAX_CELL_SIZE[1], _MAX_SIZE[1] / (rows * ys)
        )

    @cached_property
    def panel(self) -> tuple[float, float]:
        """Width and height of a panel."""
        return len(self.levels[3]) * self.cell[0], len(self.levels[2]) * self.cell[1]

    @cached_property
    def panels_size(self) -> tuple[float, float]:
        """Width and height of all panels with the gaps between them."""
        return len(self.levels[1]) * (self.panel[0] + GAP), len(self.levels[0]) * (
            self.panel[1] + GAP
        )

    @cached_property
    def titles(self) -> tuple[str, str]:
        """Titles of the axes x and y."""
        (width, height), (x_excess, y_excess) = self.panels_size, _TITLE_EXCESS
        x, y = self.map_.title(self.map_.spec.x), self.map_.title(self.map_.spec.y)
        return (
            _wrap(x, width + x_excess, AXIS_FONT_SIZE),
            _wrap(y, height + y_excess, AXIS_FONT_SIZE),
        )

    @cached_property
    def column_titles(self) -> list[str]:
        """Titles above the columns of panels."""
        columns = self.map_.spec.columns
        if columns is None:
            return []
        title = self.map_.title(columns)
        texts = (
            f"{title}: {_label_text(label)}" if title else _label_text(label)
            for label in self.levels[1]
        )
        return [
            _wrap_and_break(text, self.panel[0] + GAP - _PAD, PANEL_FONT_SIZE) for text in texts
        ]

    @cached_property
    def row_titles(self) -> list[str]:
        """Titles beside the rows of panels."""
        if self.map_.spec.rows is None:
            return []
        height = self.panel[1] + GAP - _PAD
        return [
            _wrap_and_break(_label_text(label), height, AXIS_FONT_SIZE, "bold")
            for label in self.levels[0]
        ]

    @cached_property
    def y_ticks(self) -> dict[int, str]:
        """Tick labels along y by index.

        Only every n-th where cells are lower than a line of text.
        """
        return _every_nth_label(list(map(_label_text, self.levels[2])), self.cell[1])

    @cached_property
    def x_ticks(self) -> dict[int, str]:
        """Tick labels of the x axis by index.

        Wrapped to the width of a cell, or rotated with every n-th label only.
        """
        if self.rotate_x_labels:
            return _every_nth_label(list(map(_label_text, self.levels[3])), self.cell[0])
        return dict(enumerate(self._wrapped_x_labels))

    @cached_property
    def rotate_x_labels(self) -> bool:
        """True if tick labels along x must be rotated: a word is wider than a cell."""
        return (
            _text_width("\n".join(self._wrapped_x_labels).split("\n"), TICK_FONT_SIZE)
            > self.cell[0] - _PAD
        )

    @cached_property
    def _wrapped_x_labels(self) -> list[str]:
        return [
            _wrap(_label_text(label), self.cell[0] - _PAD, TICK_FONT_SIZE)
            for label in self.levels[3]
        ]


def _label_text(label: Any) -> str:
    return f"{label:g}" if isinstance(label, float) else str(label)


def _wrap(
    text: str, width: float, size: float, weight: str = "normal", break_words: bool = False
) -> str:
    """Break a text into lines of at most `width` between words.

    `break_words` also breaks between characters.
    """
    # `textwrap` counts characters, so the number of characters per line begins at an estimate from
    # their average width, and falls until the widest line fits.
    average = _text_width([text], size, weight) / max(1, len(text))
    longest = min(len(text), int(_WIDTH_VARIATION * width / average)) if average else 1
    lines = [text]
    for characters in range(longest, 0, -1):
        lines = textwrap.wrap(
            text, characters, break_long_words=break_words, break_on_hyphens=False
        )
        if _text_width(lines, size, weight) <= width:
            break
    return "\n".join(lines)


def _wrap_and_break(text: str, width: float, size: float, weight: str = "normal") -> str:
    """Break a text between words, and lines that are still too wide between characters."""
    lines = _wrap(text, width, size, weight).split("\n")
    return "\n".join(_wrap(line, width, size, weight, break_words=True) for line in lines)


def _text_width(lines: Iterable[str], size: float, weight: str = "normal") -> float:
    """Return the width of the widest line."""
    return max((_line_width(line, size, weight) for line in lines if line.strip()), default=0.0)


@lru_cache(4096)  # wrapping measures the same words again and again
def _line_width(line: str, size: float, weight: str) -> float:
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size, weight=weight)
    return float(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0]) / 72


def _every_nth_label(texts: Sequence[str], space: float) -> dict[int, str]:
    """Return every n-th text by index.

    n is the smallest number for which lines of text `space` apart do not touch.
    """
    step = math.ceil(1.2 * TICK_FONT_SIZE / 72 / space)
    return dict(list(enumerate(texts))[::step])
