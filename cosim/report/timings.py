"""Figure that compares the real-time factors of runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..core.errors import InputError
from ..results import Result

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMN_WIDTH, PAGE_WIDTH, BAR_WIDTH = 3.5, 7.16, 0.8  # in
#: range of real-time factors of the published simulator (Simulink and V-REP over TCP): figure 18
#: and section 6.3 of the paper
PUBLISHED_FACTORS = (0.5, 0.7)


def draw_timings(result: Result, others: Sequence[Result] = ()) -> Figure:
    """Draw the real-time factors of `result` and `others` as bars on a logarithmic axis, with those of the paper as a band.

    The figure is as wide as a column or, for many runs, up to a page of a two-column paper.

    Raises:
        InputError: A result has no wall time of the stepping loop.
    """
    from matplotlib.figure import Figure

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
