"""Videos of runs: frames that a component of the scenario renders, encoded as MP4 (H.264).

The class of a Python component may have a static method `video_frames(result, camera, times, size)`
that yields a uint8 frame of shape (height, width, 3) for each of `times` (s), seen from the camera
of that name; `size` is (width, height) in pixels.
"""

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
from ..scenario.file_paths import relocating
from ..scenario.sources import change_paths, kind_of
from .frames import RENDER_METHOD, RenderJob, render_frames
from .scene import flatten_components, static_method

if TYPE_CHECKING:
    import numpy as np

DEFAULT_SIZE = (640, 360)  # pixels
DEFAULT_FRAME_RATE = 25  # frames per second


def write_video(
    result: Result,
    path: Path,
    camera: str,
    size: tuple[int, int] = DEFAULT_SIZE,
    frame_rate: int = DEFAULT_FRAME_RATE,
    frame_source: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write a video of a run in real time and return its path.

    Args:
        result: The run.
        path: The MP4 file to write.
        camera: The name of a camera of the scene.
        size: Width and height in pixels, both even.
        frame_rate: Frames per second.
        frame_source: The class "file.py:Class" with the method `video_frames`; None: that of a
            component of the scenario.
        progress: Called with the number of finished frames and the number of all frames.

    Raises:
        InputError: The extra "video" is missing, the camera is unknown, or no component of the run
            renders frames.
    """
    encoder = _import_encoder()
    source = frame_source or find_frame_source(result)
    job = RenderJob(source, result, camera, frame_times(result, frame_rate), size)
    with writing_atomically(path) as temporary:
        file = temporary.with_suffix(".mp4")
        try:
            _encode_video(encoder, job, file, frame_rate, progress)
            file.replace(temporary)
        finally:
            file.unlink(missing_ok=True)
    return path


def find_frame_source(result: Result) -> str:
    """Return the "file.py:Class" of the first component of the run's scenario that renders video frames.

    Raises:
        InputError: No component renders frames, or the source file of a component does not exist.
    """
    if "scenario_file" in result.metadata:
        folder = Path(result.metadata["scenario_file"]).parent
        for _, component, component_folder in flatten_components(
            result.metadata["scenario"], folder
        ):
            if static_method(component, component_folder, RENDER_METHOD):
                system = {"components": {"source": component}}
                absolute = change_paths(system, relocating(component_folder, None))
                return str(absolute["components"]["source"][kind_of(component).KEY])
    raise InputError(
        "no component of the scenario renders a video: none is a Python class with a static "
        f'method "{RENDER_METHOD}"'
    )


def frame_times(result: Result, rate: int) -> np.ndarray:
    """Return the times (s) of the frames of a run, `rate` per second, shape (frames,)."""
    import numpy as np

    start, stop = float(result.time[0]), float(result.time[-1])
    times: np.ndarray = start + np.arange(int((stop - start) * rate + 1e-9) + 1) / rate
    return times


def _import_encoder() -> ModuleType:
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError('videos need the extra "video": pip install "fmi-cosim[video]"') from None
    module: ModuleType = imageio_ffmpeg
    return module


def _encode_video(
    encoder: ModuleType,
    job: RenderJob,
    file: Path,
    rate: int,
    progress: Callable[[int, int], None] | None,
) -> None:
    with closing(render_frames(job)) as frames:
        first = next(
            frames
        )  # before the encoder starts, which would add its own message to an error
        writer = encoder.write_frames(
            str(file), job.size, fps=rate, macro_block_size=2, quality=7, ffmpeg_log_level="error"
        )
        writer.send(None)
        with closing(writer):
            for finished, frame in enumerate(chain([first], frames), start=1):
                writer.send(frame.tobytes())
                if progress:
                    progress(finished, len(job.times))
