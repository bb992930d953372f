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
from ..results.files import writing_atomically
from .frames import RenderJob, render_frames

if TYPE_CHECKING:
    import numpy as np

#: function(result, camera, moments, size) that yields a uint8 frame (height, width, 3) for each moment; of the shipped plant
FRAME_SOURCE = "plant_src/scene/video.py:frames"
DEFAULT_SIZE = (640, 360)  # pixels
DEFAULT_FRAME_RATE = 25  # frames per second


def write_video(
    result: Result,
    path: Path,
    camera: str,
    size: tuple[int, int] = DEFAULT_SIZE,
    frame_rate: int = DEFAULT_FRAME_RATE,
    frames: str = FRAME_SOURCE,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the run in real time to `path` as `camera` sees it; returns the path. `size` in pixels, both even.

    `progress` is called with the number of finished frames and of all. Raises InputError when the extra "video" is missing,
    the camera unknown or the run without a scene.
    """
    encoder = _import_encoder()
    job = RenderJob(frames, result, camera, frame_times(result, frame_rate), size)
    with writing_atomically(path) as temporary:
        file = temporary.with_suffix(".mp4")
        try:
            _encode_video(encoder, job, file, frame_rate, progress)
            file.replace(temporary)
        finally:
            file.unlink(missing_ok=True)
    return path


def frame_times(result: Result, rate: int) -> np.ndarray:
    """`rate` moments (s) per second from the start to the end of a run."""
    import numpy as np

    start, stop = result.time[0], result.time[-1]
    return start + np.arange(int((stop - start) * rate + 1e-9) + 1) / rate


def _import_encoder() -> ModuleType:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError('videos need the extra "video": pip install "fmi-cosim[video]"') from None
    module: ModuleType = imageio_ffmpeg
    return module


def _encode_video(
    encoder: ModuleType, job: RenderJob, file: Path, rate: int, progress: Callable[[int, int], None] | None
) -> None:
    with closing(render_frames(job)) as frames:
        first = next(frames)  # before anything is written, so that a refusal comes alone
        writer = encoder.write_frames(str(file), job.size, fps=rate, macro_block_size=2, quality=7, ffmpeg_log_level="error")
        writer.send(None)
        with closing(writer):
            for finished, frame in enumerate(chain([first], frames), start=1):
                writer.send(frame.tobytes())
                if progress:
                    progress(finished, len(job.times))
