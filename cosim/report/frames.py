"""Frames of a video, rendered by several processes: frame i comes from process i modulo their number.

Each is this module as a program: it reads its job from standard input and writes one pickle a frame to standard output, where
it waits while nobody reads, so that no frames pile up.
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
from typing import TYPE_CHECKING, Any

from ..components.python_import import load_object
from ..core.errors import CosimError
from ..core.resources import root
from ..results import Result

if TYPE_CHECKING:
    import numpy as np

#: frames that are worth the start of a process
MIN_FRAMES_PER_PROCESS = 25
MAX_PROCESSES = 8


@dataclass(frozen=True)
class RenderJob:
    """What to render: `source` names a function(result, camera, moments, size) that yields a frame for each moment (s)."""

    source: str
    result: Result
    camera: str
    times: np.ndarray
    size: tuple[int, int]

    def frames(self) -> Iterator[np.ndarray]:
        """The frames, uint8 (height, width, 3), rendered here."""
        function: Callable[..., Iterator[Any]] = load_object(self.source, root())
        return function(self.result, self.camera, self.times, self.size)


def render_frames(job: RenderJob, processes: int | None = None) -> Generator[np.ndarray, None, None]:
    """The frames of a job, by as many processes (None: as there are processors, and as are worth it)."""
    if processes is None:
        processes = min(os.cpu_count() or 1, MAX_PROCESSES, len(job.times) // MIN_FRAMES_PER_PROCESS)
    if processes < 2:
        yield from job.frames()
        return
    with ExitStack() as stack:
        workers = [stack.enter_context(_render_process(replace(job, times=job.times[k::processes]))) for k in range(processes)]
        for i in range(len(job.times)):
            yield _receive_frame(workers[i % processes])


@contextmanager
def _render_process(job: RenderJob) -> Iterator[subprocess.Popen[bytes]]:
    """A process at work, ended with the block."""
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
    """The next frame of a process; what it raised is raised here."""
    assert worker.stdout is not None
    try:
        item: np.ndarray | BaseException = pickle.load(worker.stdout)  # noqa: S301
    except EOFError:
        raise CosimError(f"a process that renders frames ended with exit code {worker.wait()}") from None
    if isinstance(item, BaseException):
        raise item
    return item


def main() -> None:
    """Render the job on standard input. Libraries may print: their standard output is not ours."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted as well, and ends this process
    with os.fdopen(os.dup(1), "wb") as channel:
        os.dup2(2, 1)
        job: RenderJob = pickle.load(sys.stdin.buffer)  # noqa: S301
        try:
            for frame in job.frames():
                pickle.dump(frame, channel)
                channel.flush()
        except Exception as error:
            pickle.dump(error, channel)


if __name__ == "__main__":
    main()
