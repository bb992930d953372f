"""Figures of a mission, with the colours, line styles and layout that they share.

Horizontal paths, tracking error over time and landing over time (figures 14 to 16 of the paper).

Every function takes a result and names of signals or signal prefixes, like the KPIs in `kpis.py`.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.text import Text

from cosim.results import Result
from cosim.results.kpi import Prefix, Signal

from .kpis import waypoints
from .recorded_motion import horizontal_distance, touchdown_row, used_waypoints

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
    """Set equal scales, and the height of a figure at which the axes fill its width.

    The figure has a constrained layout.
    """
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


TIME_AFTER_TOUCHDOWN = 4.0  # s, shown by default
MIN_SPAN = 1e-3  # s, of the axis of a run that failed at its start
MIN_PLOTTED_ERROR = 1e-3  # m, lower end of the logarithmic axis


def paths(
    result: Result,
    vehicle: Prefix,
    deck: Prefix,
    waypoint_x: Sequence[float] = (),
    waypoint_y: Sequence[float] = (),
    acceptance_radius: float = 0.0,
    waypoint_count: float | None = None,
    platforms: Mapping[str, Mapping[str, Sequence[float]]] | None = None,
) -> Figure:
    """Draw the paths of a multirotor and a vessel in the horizontal plane.

    Dots mark their first positions.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the multirotor ("plant.uav").
        deck: Signal prefix of the vessel's landing deck ("plant.usv.deck").
        waypoint_x: East coordinates of the vessel's waypoints (m, world).
        waypoint_y: North coordinates of the vessel's waypoints (m, world).
        acceptance_radius: Radius of the circles of acceptance (m).
        waypoint_count: Number of waypoints that are used; None: all.
        platforms: Platforms as in the arguments of the plant: {"start": {"size": [x, y, z],
            "position": [x, y, z]}}, edges and centre (m, world).

    Returns:
        Figure of column width, one metre equally long along both axes.
    """
    figure = Figure(figsize=(COLUMN_WIDTH, COLUMN_WIDTH), layout="constrained")
    axes = figure.add_subplot(xlabel="x / m", ylabel="y / m")
    for name, platform in (platforms or {}).items():
        _draw_platform(axes, name, platform)
    _draw_waypoints(axes, used_waypoints(waypoint_x, waypoint_y, waypoint_count), acceptance_radius)
    _draw_path(axes, result, deck.removesuffix(".deck"), color=VESSEL_COLOUR, label="vessel")
    _draw_path(
        axes,
        result,
        vehicle,
        color=MULTIROTOR_COLOUR,
        label="quadcopter",
        linestyle=(0, (1.2, 1.0)),
    )
    row = touchdown_row(result, vehicle)
    if row is not None:
        axes.plot(
            *(result[f"{vehicle}.position.{axis}"][row] for axis in "xy"),
            **TOUCHDOWN_MARKER,
            label="touchdown",
            zorder=6,
        )
    add_legend(figure, "outside upper center")
    fit_height(figure, axes)
    return figure


def _draw_platform(axes: Axes, name: str, platform: Mapping[str, Sequence[float]]) -> None:
    (width, height), (x, y) = platform["size"][:2], platform["position"][:2]
    corner = (x - width / 2, y - height / 2)
    axes.add_patch(
        Rectangle(
            corner, width, height, facecolor="#F0EAE0", edgecolor="#C8B89A", linewidth=0.6, zorder=1
        )
    )
    annotate(axes, name, corner, offset=(3, 3), color="#8A7650")


def _draw_waypoints(axes: Axes, waypoints: Sequence[tuple[float, float]], radius: float) -> None:
    if waypoints:
        axes.plot(
            *zip(*waypoints, strict=True),
            "+",
            color="#555555",
            markersize=5,
            label="waypoints",
            zorder=2,
        )
    for number, (east, north) in enumerate(waypoints, start=1):
        axes.add_patch(
            Circle(
                (east, north),
                radius,
                fill=False,
                color="#888888",
                linestyle="--",
                linewidth=0.7,
                zorder=2,
            )
        )
        annotate(
            axes,
            str(number),
            (east + 0.7 * radius, north + 0.7 * radius),
            offset=(1, 1),
            color="#333333",
        )


def _draw_path(axes: Axes, result: Result, vehicle: str, **line: Any) -> None:
    x, y = (result[f"{vehicle}.position.{axis}"] for axis in "xy")
    axes.plot(x, y, **line, linewidth=1.4, zorder=3)
    axes.plot(
        x[:1], y[:1], "o", color=line["color"], markersize=4.5, markeredgecolor="white", zorder=4
    )


def landing(
    result: Result,
    vehicle: Prefix,
    deck: Prefix,
    altitude_reference: Signal | None = None,
    mode: Signal | None = None,
    phases: Sequence[str] = (),
    limit: float | None = None,
    start: float = 0.0,
    stop: float | None = None,
) -> Figure:
    """Draw the altitudes of a multirotor and the deck, and their horizontal distance, over time.

    The axis of the distance is logarithmic.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the multirotor ("plant.uav").
        deck: Signal prefix of the landing deck ("plant.usv.deck").
        altitude_reference: Signal with the commanded altitude (m).
        mode: Signal with the flight mode; each mode is drawn as a shaded time span.
        phases: Names of the modes 1, 2, ...
        limit: Horizontal error that is marked by a line (m).
        start: First time shown (s).
        stop: Last time shown (s); by default 4 s after touchdown, or the end of a run without
            touchdown.

    Returns:
        Figure of column width with two panels.
    """
    row = touchdown_row(result, vehicle)
    if stop is None:
        stop = (
            result.time[-1]
            if row is None
            else min(result.time[-1], result.time[row] + TIME_AFTER_TOUCHDOWN)
        )
    shown = slice(*np.searchsorted(result.time, (start, stop + 1e-9)))
    figure = Figure(figsize=(COLUMN_WIDTH, 3.4), layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 2))
    lines: list[tuple[str, Mapping[str, Any]]] = [
        (f"{deck}.position.z", {"color": VESSEL_COLOUR, "label": "deck"}),
        (f"{vehicle}.position.z", {"color": MULTIROTOR_COLOUR, "label": "quadcopter"}),
    ]
    if altitude_reference is not None:
        style = {"color": REFERENCE_COLOUR, "linestyle": "--", "linewidth": 0.9}
        lines.append((altitude_reference, {**style, "label": "reference"}))
    for name, line in lines:
        above.plot(result.time[shown], result[name][shown], **line)
    _draw_error(below, result.time[shown], horizontal_distance(result, vehicle, deck)[shown], limit)
    above.set(ylabel="z / m", xlim=(start, max(stop, start + MIN_SPAN)))
    below.set(xlabel="t / s")
    if mode is not None:
        _shade_phases(figure, result.time[shown], result[mode][shown], phases)
    if row is not None:
        time, altitude = result.time[row], result[f"{vehicle}.position.z"][row]
        for axes in (above, below):
            axes.axvline(time, color=TOUCHDOWN_COLOUR, linewidth=0.8, linestyle=":")
        above.plot(time, altitude, **TOUCHDOWN_MARKER, label="touchdown", zorder=5)
    add_legend(figure, "outside lower center")
    figure.align_ylabels()
    return figure


def _draw_error(axes: Axes, time: np.ndarray, error: np.ndarray, limit: float | None) -> None:
    axes.plot(time, np.maximum(error, MIN_PLOTTED_ERROR), color=MULTIROTOR_COLOUR)
    axes.set(yscale="log", ylabel="horizontal\nerror / m")
    axes.yaxis.set_major_formatter("{x:g}")
    if limit is not None:
        axes.axhline(
            limit, color=REFERENCE_COLOUR, linestyle="--", linewidth=0.9, label=f"limit {limit:g} m"
        )


def _shade_phases(
    figure: Figure, time: np.ndarray, mode: np.ndarray, phases: Sequence[str]
) -> None:
    """Shade each time span of constant mode in all axes and write its name above the first axes."""
    changes = [0, *(np.flatnonzero(np.diff(mode)) + 1), len(time) - 1]
    for first, last in pairwise(changes):
        value = int(mode[first])
        for axes in figure.axes:
            axes.axvspan(
                time[first],
                time[last],
                color=PHASE_COLOURS[value % len(PHASE_COLOURS)],
                linewidth=0,
                zorder=0,
            )
        name = phases[value - 1] if 0 < value <= len(phases) else str(value)
        _label_span(figure.axes[0], time[first], time[last], name)


def _label_span(axes: Axes, first: float, last: float, name: str) -> None:
    """Write `name` above a time span.

    Rotated by 90 degrees if it is too long, omitted if the span is under 6 pt wide.
    """
    left, right = axes.get_xlim()
    width = (last - first) / (right - left) * 0.78 * COLUMN_WIDTH * 72  # pt
    if width < 6:
        return
    text = axes.text(
        (first + last) / 2,
        1.02,
        name,
        transform=axes.get_xaxis_transform(),
        fontsize=6.5,
        color="#444444",
    )
    text.set(ha="center", va="bottom", rotation=90 if width < 3.6 * len(name) else 0)


def tracking_error(
    result: Result,
    vehicle: Prefix,
    target: Prefix,
    waypoint_x: Sequence[float] = (),
    waypoint_y: Sequence[float] = (),
    acceptance_radius: float = 0.0,
    waypoint_count: float | None = None,
    limit: float | None = None,
    start: float = 0.0,
) -> Figure:
    """Draw the horizontal distance of a vehicle from its target over time, on a logarithmic axis.

    Numbered lines mark the turns of the target's vessel: the times at which it reaches its
    waypoints.

    Args:
        result: Recorded mission.
        vehicle: Signal prefix of the vehicle ("plant.uav").
        target: Signal prefix of the target ("plant.usv.deck").
        waypoint_x: East coordinates of the vessel's waypoints (m, world).
        waypoint_y: North coordinates of the vessel's waypoints (m, world).
        acceptance_radius: Radius of the circles of acceptance (m).
        waypoint_count: Number of waypoints that are used; None: all.
        limit: Distance that is marked by a line (m).
        start: First time shown (s).

    Returns:
        Figure of column width.
    """
    figure = Figure(figsize=(COLUMN_WIDTH, 2.2), layout="constrained")
    axes = figure.add_subplot()
    shown = slice(int(np.searchsorted(result.time, start)), None)
    _draw_error(
        axes, result.time[shown], horizontal_distance(result, vehicle, target)[shown], limit
    )
    axes.set(xlabel="t / s", xlim=(start, max(result.time[-1], start + MIN_SPAN)))
    if limit is not None:
        figure.legend(loc="outside lower right")
    if len(waypoint_x):
        vessel = target.removesuffix(".deck")
        reached = waypoints(
            result, vessel, waypoint_x, waypoint_y, acceptance_radius, waypoint_count
        )
        first, last = axes.get_xlim()
        *times, _ = (time for key, time in reached.items() if key.startswith("time"))
        for number, time in enumerate(times, start=1):  # no turn follows the last waypoint
            if first <= time <= last:
                axes.axvline(time, color=VESSEL_COLOUR, linewidth=0.8, linestyle=":", zorder=1)
                axes.text(
                    time,
                    1.02,
                    f"turn {number}",
                    transform=axes.get_xaxis_transform(),
                    ha="center",
                    fontsize=6.5,
                    color=VESSEL_COLOUR,
                )
    return figure
