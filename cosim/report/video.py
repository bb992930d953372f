"""Videos of runs: frames that a component of the scenario renders, encoded as MP4 (H.264).

The class of a Python component may have a static method `video_frames(result, camera, times, size)`
that yields a uint8 frame of shape (height, width, 3) for each of `times` (s), seen from the camera
of that name; `size` is (width, height) in pixels.

Of n worker processes, number k renders the frames k, k + n, k + 2n, ... A worker process runs this
module as a program. It reads a pickled job from standard input and writes one pickle per frame to
standard output. The pipe blocks it until the frames are read, so that they do not fill the memory.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from ..components.python_import import load_object
from ..core.errors import CosimError, InputError
from ..core.resources import available_processors
from ..results import Result
from ..results.files import writing_atomically
from ..scenario.component_schema import change_paths
from ..scenario.component_sources import kind_of
from ..scenario.file_paths import relocating
from .scene import flatten_components, static_method

if TYPE_CHECKING:
    import numpy as np

DEFAULT_SIZE = (640, 360)  # pixels
DEFAULT_FRAME_RATE = 25  # frames per second
#: fewest frames for which another process is started, and the largest number of processes
MIN_FRAMES_PER_PROCESS, MAX_PROCESSES = 25, 8

#: static method of a component class that renders frames (see `video`)
RENDER_METHOD = "video_frames"


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
    try:
        import imageio_ffmpeg
    except ImportError:
        raise InputError('videos need the extra "video": pip install "fmi-cosim[video]"') from None
    encoder: ModuleType = imageio_ffmpeg
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
    """Return the "file.py:Class" of the first component that renders video frames.

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


def _encode_video(
    encoder: ModuleType,
    job: RenderJob,
    file: Path,
    rate: int,
    progress: Callable[[int, int], None] | None,
) -> None:
    with closing(render_frames(job)) as frames:
        # before the encoder starts, which would add its own message to an error
        first = next(frames)
        writer = encoder.write_frames(
            str(file), job.size, fps=rate, macro_block_size=2, quality=7, ffmpeg_log_level="error"
        )
        writer.send(None)
        with closing(writer):
            for finished, frame in enumerate(chain([first], frames), start=1):
                writer.send(frame.tobytes())
                if progress:
                    progress(finished, len(job.times))


@dataclass(frozen=True)
class RenderJob:
    """Frames to render.

    The class `source` ("file.py:Class") renders one at each of `times` (s) with its `video_frames`.
    """

    source: str
    result: Result
    camera: str
    times: np.ndarray
    size: tuple[int, int]

    def frames(self) -> Iterator[np.ndarray]:
        """Render the frames in this process: uint8, shape (height, width, 3)."""
        render: Callable[..., Iterator[np.ndarray]] = getattr(
            load_object(self.source, Path()), RENDER_METHOD
        )
        return render(self.result, self.camera, self.times, self.size)


def render_frames(
    job: RenderJob, processes: int | None = None
) -> Generator[np.ndarray, None, None]:
    """Yield the frames of a job in their order, rendered by several processes.

    Args:
        job: The frames to render.
        processes: The number of processes; None: one per processor, but fewer for a short video.

    Raises:
        CosimError: A process ended without an error message, for example by a crash.
    """
    if processes is None:
        processes = min(
            available_processors(), MAX_PROCESSES, len(job.times) // MIN_FRAMES_PER_PROCESS
        )
    if processes < 2:
        yield from job.frames()
        return
    with ExitStack() as stack:
        workers = [
            stack.enter_context(_render_process(replace(job, times=job.times[k::processes])))
            for k in range(processes)
        ]
        for i in range(len(job.times)):
            yield _receive_frame(workers[i % processes])


@contextmanager
def _render_process(job: RenderJob) -> Iterator[subprocess.Popen[bytes]]:
    """Run a worker process for a job; it is killed at the end of the block."""
    command = [sys.executable, "-P", "-m", __name__]
    worker = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)  # noqa: S603
    with worker:
        try:
            assert worker.stdin is not None
            pickle.dump(job, worker.stdin)
            worker.stdin.close()
            yield worker
        finally:
            worker.kill()


def _receive_frame(worker: subprocess.Popen[bytes]) -> np.ndarray:
    """Return the next frame of a worker process, or raise the exception that it raised."""
    assert worker.stdout is not None
    try:
        item: np.ndarray | BaseException = pickle.load(worker.stdout)  # noqa: S301
    except EOFError:
        raise CosimError(
            f"a process that renders frames ended with exit code {worker.wait()}"
        ) from None
    if isinstance(item, BaseException):
        raise item
    return item


def main() -> None:
    """Render the job on standard input and write the frames to standard output."""
    # an interrupt reaches the parent too, which kills this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with os.fdopen(os.dup(1), "wb") as channel:
        os.dup2(2, 1)  # what libraries print goes to standard error
        job: RenderJob = pickle.load(sys.stdin.buffer)  # noqa: S301
        try:
            for frame in job.frames():
                pickle.dump(frame, channel)
                channel.flush()
        except Exception as error:
            pickle.dump(error, channel)


if __name__ == "__main__":
    main()
