"""Figure of a comparison with a reference: the signals with the largest deviations and their tolerance tubes."""

from __future__ import annotations

from collections.abc import Mapping

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..results import Result
from ..results.comparison import Comparison, Tolerance, Verdict
from ..results.comparison.comparison import Comparer, match_tolerances

WIDTH, HEIGHT = 7.16, 1.7  # in, of the figure and of each panel
OUTSIDE_COLOUR = "#D55E00"


def draw_tubes(
    result: Result, reference: Result, tolerances: Mapping[str, Tolerance], comparison: Comparison, max_signals: int = 4
) -> Figure:
    """Draw the signals with the largest deviations over time, a panel each, with their tolerance tubes.

    Args:
        result: The result that was compared.
        reference: The reference.
        tolerances: Tolerances by pattern of signal names.
        comparison: The outcome of the comparison.
        max_signals: The largest number of panels.
    """
    worst = [verdict for verdict in comparison.worst if reference[verdict.signal].dtype != object][:max_signals]
    figure = Figure(figsize=(WIDTH, HEIGHT * max(len(worst), 1)), layout="constrained")
    if not worst:
        figure.text(0.5, 0.5, "nothing can be compared", ha="center")
        return figure
    chosen, comparer = match_tolerances(tolerances, list(reference)), Comparer(result, reference)
    panels = figure.subplots(len(worst), sharex=True, squeeze=False)[:, 0]
    for axes, verdict in zip(panels, worst, strict=True):
        _draw_panel(axes, comparer, verdict, chosen[verdict.signal], result, reference)
    handles = {label: handle for axes in panels for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)}
    figure.legend(handles.values(), handles, loc="outside upper right", ncols=4)
    panels[-1].set_xlabel("time (s)")
    return figure


def _draw_panel(
    axes: Axes, comparer: Comparer, verdict: Verdict, tolerance: Tolerance, result: Result, reference: Result
) -> None:
    name = verdict.signal
    tube = comparer.tube(name, tolerance)
    axes.fill_between(tube.time, tube.lower, tube.upper, color="#0072B2", alpha=0.2, linewidth=0, label="tube")
    axes.plot(reference.time, reference[name], "--", color="#0072B2", label="reference", linewidth=0.9)
    axes.plot(result.time, result[name], color="black", label="result", linewidth=0.9)
    if not verdict.passed:
        axes.axvline(verdict.time, color=OUTSIDE_COLOUR, linewidth=0.8)
        values, outside = comparer.points.interpolate_result(result[name]), comparer.is_outside(name, tolerance)
        axes.plot(tube.time[outside], values[outside], ".", color=OUTSIDE_COLOUR, markersize=2, label="outside")
    axes.set_xlim(reference.time[0], reference.time[-1])
    axes.set_title(name, loc="left")
    axes.set_ylabel(reference.units.get(name) or result.units.get(name) or "")
