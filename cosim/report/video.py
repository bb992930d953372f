"""A run as a video: frames of a scene, written as MP4 (H.264)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..python_component import load_object
from ..resources import root
from ..results import Result
from ..results.files import replacing

if TYPE_CHECKING:
    import numpy as np

#: function(result, camera, rate, size) that yields uint8 frames (height, width, 3); a file of the shipped plant
FRAMES = "plant_src/scene/video.py:frames"
SIZE = (640, 360)  # pixels
RATE = 15  # frames per second


def write_video(
    result: Result, path: Path, camera: str, size: tuple[int, int] = SIZE, rate: int = RATE, frames: str = FRAMES
) -> Path:
    """Write the run in real time to `path` as `camera` sees it; returns the path. `size` in pixels, both even.

    Raises InputError when the extra "video" is missing, the camera unknown or the run without a scene.
    """
    encoder = _encoder()
    function: Callable[..., Iterator[Any]] = load_object(frames, root())
    with replacing(path) as temporary:
        file = temporary.with_suffix(".mp4")
        try:
            _encode(encoder, function(result, camera, rate, size), file, size, rate)
            file.replace(temporary)
        finally:
            file.unlink(missing_ok=True)
    return path


def _encoder() -> ModuleType:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError('videos need the extra "video": pip install "fmi-cosim[video]"') from None
    module: ModuleType = imageio_ffmpeg
    return module


def _encode(encoder: ModuleType, frames: Iterable[np.ndarray], file: Path, size: tuple[int, int], rate: int) -> None:
    frames = iter(frames)
    first = next(frames)  # before anything is written, so that a refusal comes alone
    writer = encoder.write_frames(str(file), size, fps=rate, macro_block_size=2, quality=7, ffmpeg_log_level="error")
    writer.send(None)
    try:
        for frame in chain([first], frames):
            writer.send(frame.tobytes())
    finally:
        writer.close()
