"""A run as a video: frames of a scene, written as MP4 (H.264)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from ..core.errors import InputError
from ..results import Result
from ..results.files import replacing
from .frames import Job, rendered

if TYPE_CHECKING:
    import numpy as np

#: function(result, camera, moments, size) that yields a uint8 frame (height, width, 3) for each moment; of the shipped plant
FRAMES = "plant_src/scene/video.py:frames"
SIZE = (640, 360)  # pixels
RATE = 25  # frames per second


def write_video(
    result: Result,
    path: Path,
    camera: str,
    size: tuple[int, int] = SIZE,
    rate: int = RATE,
    frames: str = FRAMES,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the run in real time to `path` as `camera` sees it; returns the path. `size` in pixels, both even.

    `progress` is called with the number of finished frames and of all. Raises InputError when the extra "video" is missing,
    the camera unknown or the run without a scene.
    """
    encoder = _encoder()
    job = Job(frames, result, camera, moments(result, rate), size)
    with replacing(path) as temporary:
        file = temporary.with_suffix(".mp4")
        try:
            _encode(encoder, job, file, rate, progress)
            file.replace(temporary)
        finally:
            file.unlink(missing_ok=True)
    return path


def moments(result: Result, rate: int) -> np.ndarray:
    """`rate` moments (s) per second from the start to the end of a run."""
    import numpy as np

    start, stop = result.time[0], result.time[-1]
    return start + np.arange(int((stop - start) * rate + 1e-9) + 1) / rate


def _encoder() -> ModuleType:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError('videos need the extra "video": pip install "fmi-cosim[video]"') from None
    module: ModuleType = imageio_ffmpeg
    return module


def _encode(encoder: ModuleType, job: Job, file: Path, rate: int, progress: Callable[[int, int], None] | None) -> None:
    with closing(rendered(job)) as frames:
        first = next(frames)  # before anything is written, so that a refusal comes alone
        writer = encoder.write_frames(str(file), job.size, fps=rate, macro_block_size=2, quality=7, ffmpeg_log_level="error")
        writer.send(None)
        with closing(writer):
            for finished, frame in enumerate(chain([first], frames), start=1):
                writer.send(frame.tobytes())
                if progress:
                    progress(finished, len(job.moments))
