"""Video frames of a mission."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cosim.results import Result

from .mission import mission_of_result
from .render import Scene


def frames(
    result: Result, camera: str, moments: np.ndarray, size: tuple[int, int]
) -> Iterator[np.ndarray]:
    """Yield the frames of a video.

    Args:
        result: Recorded mission.
        camera: Name of the camera (`cameras.py`).
        moments: Times of the frames (s).
        size: Width and height (pixels), both even.

    Yields:
        Frames, uint8 (height, width, 3).

    Raises:
        InputError: `camera` is unknown or the result has no plant with vehicles.
    """
    with Scene(mission_of_result(result)) as scene:
        for row in np.searchsorted(result.time, moments - 1e-9).tolist():
            yield scene.render(camera, [row], [1.0], *size, supersampling=1)
