"""Colours, line styles and layout that the figures of a mission share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

MULTIROTOR_COLOUR, VESSEL_COLOUR, REFERENCE_COLOUR, TOUCHDOWN_COLOUR = (
    "#0072B2",
    "#D55E00",
    "#444444",
    "#111111",
)
PHASE_COLOURS = ("#F4F4F4", "#FFF8E1", "#EAF2FA", "#EDF6E8", "#FDEFE7", "#F2EDF8")
TOUCHDOWN_MARKER: Mapping[str, Any] = {
    "color": TOUCHDOWN_COLOUR,
    "linestyle": "",
    "marker": "*",
    "markersize": 9,
    "markeredgecolor": "white",
}
LEGEND_STYLE: Mapping[str, Any] = {
    "columnspacing": 0.7,
    "handlelength": 1.4,
    "handletextpad": 0.4,
    "borderaxespad": 0.2,
}
COLUMN_WIDTH = 3.5  # in, column of a two-column paper
MIN_PANEL_HEIGHT, MAX_PANEL_HEIGHT = 1.0, 6.0  # in, axes with equal scales


def fit_height(figure: Figure, axes: Axes) -> None:
    """Set equal scales, and the height of a figure with constrained layout at which the axes fill its width."""
    axes.margins(0.05)
    (x_first, x_last), (y_first, y_last) = axes.get_xlim(), axes.get_ylim()
    ratio = (y_last - y_first) / (x_last - x_first)
    figure.set_figheight(
        _panel_height(ratio * COLUMN_WIDTH) + 0.6
    )  # near the final one, for the number of ticks
    cast(Any, figure.get_layout_engine()).execute(figure)
    width, height = figure.get_size_inches()
    box = axes.get_position()
    figure.set_figheight(_panel_height(ratio * box.width * width) + (1 - box.height) * height)
    axes.set_aspect("equal")


def _panel_height(height: float) -> float:
    return min(MAX_PANEL_HEIGHT, max(MIN_PANEL_HEIGHT, height))


def add_legend(figure: Figure, location: str) -> None:
    """Add a legend outside of the axes with as many columns as fit into the width of the figure."""
    for columns in range(5, 0, -1):
        legend = figure.legend(ncols=columns, **{"loc": location, **LEGEND_STYLE})
        if legend.get_window_extent().width <= figure.bbox.width:
            return
        legend.remove()


def annotate(
    axes: Axes, text: str, position: tuple[float, float], offset: tuple[float, float], color: str
) -> Text:
    """Write a small text with a white outline at a position (m) plus `offset` (pt)."""
    halo = withStroke(linewidth=2, foreground="white")
    return axes.annotate(
        text,
        position,
        offset,
        textcoords="offset points",
        fontsize=6.5,
        color=color,
        path_effects=[halo],
        zorder=5,
    )
