"""Frames of a video of a mission."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cosim.results import Result

from .mission import recorded
from .render import Scene, find_camera


def frames(result: Result, camera: str, rate: int, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """The run in real time, `rate` frames (uint8, height by width by 3) per second, seen by `camera`; `size`: width, height."""
    find_camera(camera)
    mission = recorded(result)
    start, stop = result.time[0], result.time[-1]
    moments = start + np.arange(int((stop - start) * rate + 1e-9) + 1) / rate
    with Scene(mission) as scene:
        for row in np.searchsorted(result.time, moments - 1e-9).tolist():
            yield scene.render(camera, [row], [1.0], *size, fineness=1)
