"""Figure of a comparison with a reference.

The signals with the largest deviations and their tolerance tubes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..results import Result
from ..results.comparison import Comparison, Tolerance, Verdict
from ..results.comparison.comparison import Comparer, match_tolerances

WIDTH, HEIGHT = 7.16, 1.7  # in, of the figure and of each panel
TUBE_COLOUR, OUTSIDE_COLOUR = "#0072B2", "#D55E00"


def draw_tubes(
    result: Result,
    reference: Result,
    tolerances: Mapping[str, Tolerance],
    comparison: Comparison,
    max_signals: int = 4,
) -> Figure:
    """Draw the signals with the largest deviations over time with their tolerance tubes, and beside them the deviations.

    A tube that is narrow compared with the range of a signal is visible only in the panel of the deviation.

    Args:
        result: The result that was compared.
        reference: The reference.
        tolerances: Tolerances by pattern of signal names.
        comparison: The outcome of the comparison.
        max_signals: The largest number of signals.
    """
    worst = [verdict for verdict in comparison.worst if reference[verdict.signal].dtype != object][
        :max_signals
    ]
    figure = Figure(figsize=(WIDTH, HEIGHT * max(len(worst), 1)), layout="constrained")
    if not worst:
        figure.text(0.5, 0.5, "nothing can be compared", ha="center")
        return figure
    chosen, comparer = match_tolerances(tolerances, list(reference)), Comparer(result, reference)
    panels = figure.subplots(len(worst), 2, sharex=True, squeeze=False)
    for row, verdict in zip(panels, worst, strict=True):
        name = verdict.signal
        _draw_row(row, comparer, verdict, chosen[name])
        row[0].set_title(name, loc="left")
        row[1].set_title("result - reference", loc="left")
        row[0].set_ylabel(reference.units.get(name) or result.units.get(name) or "")
    handles = {
        label: handle
        for axes in panels.flat
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles, loc="outside upper right", ncols=4)
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    return figure


def _draw_row(
    row: Sequence[Axes], comparer: Comparer, verdict: Verdict, tolerance: Tolerance
) -> None:
    """Draw a signal and its tube in the first of two panels, and both minus the reference in the second."""
    tube, points = comparer.tube(verdict.signal, tolerance), comparer.points
    values, reference = comparer.series(verdict.signal)
    base = points.interpolate_reference(reference)
    for axes, shift in zip(row, (np.zeros(len(base)), base), strict=True):
        axes.fill_between(
            tube.time,
            tube.lower - shift,
            tube.upper - shift,
            color=TUBE_COLOUR,
            alpha=0.2,
            linewidth=0,
            label="tube",
        )
        axes.plot(
            tube.time, base - shift, "--", color=TUBE_COLOUR, label="reference", linewidth=0.9
        )
        axes.plot(tube.time, values - shift, color="black", label="result", linewidth=0.9)
        if not verdict.passed:
            outside = comparer.is_outside(verdict.signal, tolerance)
            axes.axvline(verdict.time, color=OUTSIDE_COLOUR, linewidth=0.8)
            axes.plot(
                tube.time[outside],
                values[outside] - shift[outside],
                ".",
                color=OUTSIDE_COLOUR,
                markersize=2,
                label="outside",
            )
        axes.set_xlim(tube.time[0], tube.time[-1])
