"""Real-time factors: simulated time over the wall time of the stepping loop."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.report.comparison_figures import draw_timings
from cosim.report.figures import draw_figure
from cosim.results import Result


def run(name, duration, loop_seconds):
    return Result(
        Recording(np.array([5.0, 5.0 + duration]), {}, {}),
        timing={"loop_seconds": loop_seconds},
        metadata={"name": name},
    )


def test_every_run_has_a_bar():
    axes = draw_timings(run("short_run", 15.0, 0.5), [run("long_run", 35.0, 70.0)]).axes[0]
    (bars,) = axes.containers
    assert [bar.get_height() for bar in bars] == [30.0, 0.5]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["short\nrun", "long\nrun"]


def test_the_published_band_is_drawn_and_within_the_axis():
    axes = draw_timings(run("fast", 10.0, 0.01)).axes[0]
    (band,) = [patch for patch in axes.patches if patch.get_label() == "published simulator"]
    assert (band.get_y(), band.get_y() + band.get_height()) == pytest.approx((0.5, 0.7))
    assert axes.get_ylim()[0] < 0.5
    assert axes.get_ylim()[1] > 1000.0


def test_a_result_without_wall_time_is_refused():
    with pytest.raises(
        InputError, match=r"^foreign: the wall time of the stepping loop is missing"
    ):
        draw_timings(run("foreign", 10.0, 0.0))


def test_the_names_of_six_runs_do_not_overlap():
    first, *others = (run(f"performance_{n}", 15.0, 0.1) for n in range(1, 7))
    figure = draw_figure(first, "timings", draw_timings, {"others": others})
    FigureCanvasAgg(figure).draw()
    extents = [label.get_window_extent() for label in figure.axes[0].get_xticklabels()]
    assert all(left.x1 < right.x0 for left, right in pairwise(extents))
