"""Colours, line styles and layout that the figures of a mission share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

MULTIROTOR_COLOUR, VESSEL_COLOUR, REFERENCE_COLOUR, TOUCHDOWN_COLOUR = "#0072B2", "#D55E00", "#444444", "#111111"
PHASE_COLOURS = ("#F4F4F4", "#FFF8E1", "#EAF2FA", "#EDF6E8", "#FDEFE7", "#F2EDF8")
TOUCHDOWN_MARKER: Mapping[str, Any] = {
    "color": TOUCHDOWN_COLOUR,
    "linestyle": "",
    "marker": "*",
    "markersize": 9,
    "markeredgecolor": "white",
}
LEGEND_STYLE: Mapping[str, Any] = {
    "ncols": 5,
    "columnspacing": 0.7,
    "handlelength": 1.4,
    "handletextpad": 0.4,
    "borderaxespad": 0.2,
}
COLUMN_WIDTH = 3.5  # in, column of a two-column paper


def fit_height(figure: Figure, axes: Axes) -> None:
    """Set the height of the figure so that axes with equal scales fill the column width."""
    left, right, below, above, max_height = 0.45, 0.08, 0.4, 0.27, 6.0  # in
    axes.margins(0.05)
    (x_first, x_last), (y_first, y_last) = axes.get_xlim(), axes.get_ylim()
    width = COLUMN_WIDTH - left - right
    height = min(max_height, max(1.0, width * (y_last - y_first) / (x_last - x_first)))
    total = below + height + above
    figure.set_size_inches(COLUMN_WIDTH, total)
    axes.set_position((left / COLUMN_WIDTH, below / total, width / COLUMN_WIDTH, height / total))


def annotate(axes: Axes, text: str, position: tuple[float, float], offset: tuple[float, float], color: str) -> Text:
    """Write a small text with a white outline at a position (m) plus `offset` (pt)."""
    halo = withStroke(linewidth=2, foreground="white")
    return axes.annotate(
        text, position, offset, textcoords="offset points", fontsize=6.5, color=color, path_effects=[halo], zorder=5
    )
