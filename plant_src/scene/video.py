"""Frames of a video of a mission."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cosim.results import Result

from .mission import mission_of_result
from .render import Scene


def frames(result: Result, camera: str, moments: np.ndarray, size: tuple[int, int]) -> Iterator[np.ndarray]:
    """A frame (uint8, height by width by 3) of the run for each of `moments` (s), seen by `camera`; `size`: width, height."""
    with Scene(mission_of_result(result)) as scene:
        for row in np.searchsorted(result.time, moments - 1e-9).tolist():
            yield scene.render(camera, [row], [1.0], *size, supersampling=1)
