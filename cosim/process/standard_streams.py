"""Standard output and standard error of a command, which works on when nobody reads them any more."""

from __future__ import annotations

import io
import os
from typing import Any, TextIO


class _BrokenPipeIgnoringFile(io.FileIO):
    """A file whose reader may go away, as `head` does: what is written from then on is dropped."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes


def ignoring_broken_pipe(stream: TextIO, duplicate: bool = False) -> TextIO:
    """The stream, working on without a reader; `apart`: on a file descriptor of its own, which foreign code does not know.

    A stream that is no file, such as that of a notebook, stays as it is.
    """
    try:
        descriptor = stream.fileno()
    except (OSError, AttributeError):
        return stream
    raw = _BrokenPipeIgnoringFile(os.dup(descriptor) if duplicate else descriptor, "w", closefd=duplicate)
    return io.TextIOWrapper(io.BufferedWriter(raw), encoding=stream.encoding, errors="replace", line_buffering=True)
