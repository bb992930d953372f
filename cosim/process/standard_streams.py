"""Standard streams that survive a closed pipe (`cosim run ... | head`) or a full disk, and escape control characters."""

from __future__ import annotations

import errno
import io
import os
import sys
from typing import Any, TextIO

from ..core.text import SPACES, escape_control_characters

#: errors of a full or defective disk
_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class _StandardFile(io.FileIO):
    """File that drops output after the reader closed the pipe, and after a disk error that was raised once.

    Disk errors of standard error are never raised, because they cannot be reported.
    """

    def __init__(self, descriptor: int, closefd: bool, ignore_disk_errors: bool):
        super().__init__(descriptor, "w", closefd=closefd)
        self._ignore_disk_errors = ignore_disk_errors

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except BrokenPipeError:
            return memoryview(data).nbytes
        except OSError as error:
            if error.errno not in _DISK_ERRORS or not self._ignore_disk_errors:
                self._ignore_disk_errors = True  # the buffer is flushed again when the process ends
                raise
            return memoryview(data).nbytes


class _EscapingStream(io.TextIOWrapper):
    """Text stream that escapes control characters.

    Attributes:
        unescaped: Text stream to the same file, for colours and cursor movements.
    """

    def __init__(self, buffer: io.BufferedWriter, encoding: str):
        super().__init__(buffer, encoding=encoding, errors="replace", line_buffering=True)
        self.unescaped = io.TextIOWrapper(
            buffer, encoding=encoding, errors="replace", write_through=True
        )

    def write(self, text: str) -> int:
        return super().write(escape_control_characters(text, keep=f"\n{SPACES}"))


def open_closed_streams() -> None:
    """Connect closed standard streams to the null device, so that no file that is opened later takes their descriptors."""
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.set_inheritable(
                os.open(os.devnull, os.O_RDWR), True
            )  # the lowest free descriptor, which is this one
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            setattr(sys, name, os.fdopen(descriptor, "w" if descriptor else "r", closefd=False))


def protected_stream(stream: TextIO, duplicate: bool = False) -> TextIO:
    """Return a text stream to the same file that ignores a closed pipe and escapes control characters.

    Args:
        stream: The stream to replace.
        duplicate: Write through a duplicated descriptor, so that foreign code that closes or redirects the original one does
            not affect the stream.

    Returns:
        The stream itself if it has no file descriptor, as in a notebook.
    """
    try:
        descriptor = stream.fileno()
    except (OSError, AttributeError):
        return stream
    raw = _StandardFile(
        os.dup(descriptor) if duplicate else descriptor,
        closefd=duplicate,
        ignore_disk_errors=descriptor == 2,
    )
    return _EscapingStream(io.BufferedWriter(raw), stream.encoding)


def unescaped(stream: TextIO) -> TextIO:
    """Return a stream to the same file that writes control characters, for text without foreign parts."""
    return getattr(stream, "unescaped", stream)
