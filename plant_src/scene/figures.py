"""Rendered figures of a mission."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke

from cosim.core.errors import InputError
from cosim.results import Result

from .mission import Mission, mission_of_result
from .render import Scene, find_camera

PAGE_WIDTH = 7.16  # in, page with two columns
IMAGE_SIZE = (960, 480)  # pixels
MIN_OPACITY = 0.3  # of the first vehicles in the sequence


def ghosts(
    result: Result,
    camera: str = "landing",
    start: float | None = None,
    stop: float | None = None,
    interval: float = 1.0,
    pixels: Sequence[int] = IMAGE_SIZE,
) -> Figure:
    """Draw the vehicles at several times in one picture (figure 17 of the paper).

    The opacity increases with the time.

    The time is written above the first vehicle.

    Args:
        result: Recorded mission.
        camera: View at the last time shown: "overview", "chase", "deck" or "landing".
        start: First time shown (s); by default 8 s before touchdown.
        stop: Last time shown (s); by default touchdown, or the end of a run without touchdown.
        interval: Time between two positions (s).
        pixels: Width and height of the picture, both even.

    Returns:
        Figure of page width.

    Raises:
        InputError: `camera` is unknown, the time span is empty or the result has no plant with
            vehicles.
    """
    mission = mission_of_result(result)
    time, landing = mission.result.time, mission.landing_rows()
    last = time[landing[-1]] if stop is None else min(stop, time[-1])
    first = time[landing[0]] if start is None else start
    if not interval > 0 or last < first:
        raise InputError(
            f"nothing to show from {first:g} s to {last:g} s in steps of {interval:g} s"
        )
    times = last - interval * np.arange(int((last - first) / interval + 1e-9) + 1)
    rows = [int(row) for row in np.searchsorted(time, times[::-1] - 1e-9)]
    width, height = pixels
    with Scene(mission) as scene:
        picture = scene.render(
            camera, rows, np.linspace(MIN_OPACITY, 1.0, len(rows) + 1)[1:].tolist(), width, height
        )
    figure = Figure(figsize=(PAGE_WIDTH, PAGE_WIDTH * height / width))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.imshow(picture, aspect="auto", interpolation="none")
    axes.set_axis_off()
    _write_times(axes, mission, rows, camera, width, height)
    return figure


def _write_times(
    axes: Axes, mission: Mission, rows: Sequence[int], camera: str, width: int, height: int
) -> None:
    """Write the time (s) above each position of the first vehicle."""
    view = find_camera(camera)(mission, rows[-1])
    vehicle = next(iter(mission.vehicles))
    above = np.array([mission.position(vehicle, row) for row in rows])
    above[:, 2] += 0.22
    for row, (x, y) in zip(rows, view.pixels(above, width, height).tolist(), strict=True):
        text = axes.text(
            x,
            y,
            f"{mission.result.time[row]:.1f} s",
            fontsize=7,
            color="#222222",
            ha="center",
            va="bottom",
        )
        text.set(path_effects=[withStroke(linewidth=2, foreground="#FFFFFFB0")], clip_on=True)
