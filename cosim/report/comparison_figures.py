"""Figures that compare runs: with a reference, and by their real-time factors."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..core.errors import InputError
from ..results import Result
from ..results.comparison import Comparer, Comparison, Verdict, match_tolerances
from ..results.tolerance_tube import Tolerance

WIDTH, HEIGHT = 7.16, 1.7  # in, of the figure and of each panel
MAX_SIGNALS = 4  # of the tubes
TUBE_COLOUR, OUTSIDE_COLOUR = "#0072B2", "#D55E00"
COLUMN_WIDTH, PAGE_WIDTH, BAR_WIDTH = 3.5, 7.16, 0.8  # in
#: range of real-time factors of the published simulator (Simulink and V-REP over TCP): figure 18
#: and section 6.3 of the paper
PUBLISHED_FACTORS = (0.5, 0.7)


def draw_tubes(
    result: Result,
    reference: Result,
    tolerances: Mapping[str, Tolerance],
    comparison: Comparison,
) -> Figure:
    """Draw the signals with the largest deviations in their tubes, and the deviations beside them.

    A tube that is narrow compared with the range of a signal is visible only in the panel of the
    deviation.

    Args:
        result: The result that was compared.
        reference: The reference.
        tolerances: Tolerances by pattern of signal names.
        comparison: The outcome of the comparison.
    """
    worst = [each for each in comparison.worst if reference[each.signal].dtype != object]
    worst = worst[:MAX_SIGNALS]
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
    handles: dict[str, Artist] = {}
    for axes in panels.flat:
        found, labels = axes.get_legend_handles_labels()
        handles |= dict(zip(labels, found, strict=True))
    figure.legend(handles.values(), handles, loc="outside upper right", ncols=4)
    for axes in panels[-1]:
        axes.set_xlabel("time (s)")
    return figure


def _draw_row(
    row: Sequence[Axes], comparer: Comparer, verdict: Verdict, tolerance: Tolerance
) -> None:
    """Draw a signal and its tube; in the second of both panels minus the reference."""
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


def draw_timings(result: Result, others: Sequence[Result] = ()) -> Figure:
    """Draw the real-time factors of runs as bars on a logarithmic axis.

    Those of the paper are a band.

    The figure is as wide as a column or, for many runs, up to a page of a two-column paper.

    Raises:
        InputError: A result has no wall time of the stepping loop.
    """
    runs = [result, *others]
    names, factors = [_tick_label(run) for run in runs], [real_time_factor(run) for run in runs]
    figure = Figure(
        figsize=(min(PAGE_WIDTH, max(COLUMN_WIDTH, BAR_WIDTH * len(runs))), 2.6),
        layout="constrained",
    )
    axes = figure.add_subplot(yscale="log", ylabel="simulated time / elapsed time")
    axes.axhspan(
        *PUBLISHED_FACTORS, color="#D55E00", alpha=0.35, linewidth=0, label="published simulator"
    )
    bars = axes.bar(range(len(runs)), factors, width=0.6, color="#0072B2", label="cosim")
    axes.bar_label(bars, [f"{factor:.3g}" for factor in factors], padding=1, fontsize=7)
    axes.axhline(1.0, color="#444444", linestyle="--", linewidth=0.9, label="real time")
    axes.set_xticks(range(len(runs)), names)
    axes.set_xlim(-0.6, len(runs) - 0.4)
    axes.set_ylim(min(0.3, *factors) / 1.2, max(*factors, 1.0) * 2.0)
    axes.grid(visible=False, axis="x")
    axes.yaxis.set_major_formatter("{x:g}")
    figure.legend(loc="outside upper center", ncols=3)
    return figure


def real_time_factor(result: Result) -> float:
    """Return the simulated time divided by the wall time of the stepping loop.

    Raises:
        InputError: The result has no wall time of the stepping loop.
    """
    loop = result.timing.get("loop_seconds", 0.0)
    if not loop or len(result.time) < 2:
        raise InputError(
            f"{_tick_label(result)}: the wall time of the stepping loop is missing "
            "(timing.loop_seconds in run.json)"
        )
    return float(result.time[-1] - result.time[0]) / loop


def _tick_label(result: Result) -> str:
    """Return the scenario's name with line breaks instead of underscores."""
    return str(result.metadata.get("name", "run")).replace("_", "\n")
