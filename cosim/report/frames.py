"""Parallel rendering of video frames.

Of n worker processes, number k renders the frames k, k + n, k + 2n, ...

A worker process runs this module as a program. It reads a pickled job from standard input and
writes one pickle per frame to standard output. The pipe blocks it until the frames are read, so
that they do not fill the memory.
"""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..components.python_import import load_object
from ..core.errors import CosimError
from ..core.processors import available_processors
from ..results import Result

if TYPE_CHECKING:
    import numpy as np

#: fewest frames for which another process is started, and the largest number of processes
MIN_FRAMES_PER_PROCESS, MAX_PROCESSES = 25, 8

#: static method of a component class that renders frames (see `video`)
RENDER_METHOD = "video_frames"


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
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # an interrupt reaches the parent too, which kills this process
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
