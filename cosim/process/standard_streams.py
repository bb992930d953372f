"""Standard streams that survive a closed pipe or a full disk, and output of foreign code."""

import codecs
import errno
import io
import os
import sys
from typing import Any, TextIO

from ..core.text import SPACES, escape_control_characters

#: errors of a full or defective disk
_DISK_ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
#: output of foreign code that is forwarded (bytes)
MAX_OUTPUT_SIZE = 1 << 16

_READ_SIZE = 1 << 16
#: largest number of reads at once, which bounds the time away from other work
_MAX_READS = 64


class _StandardFile(io.FileIO):
    """File that drops output after its pipe was closed, or after a disk error was raised once.

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
    """Connect closed standard streams to the null device.

    No file that is opened later takes their descriptors.
    """
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
    """Return a stream to the same file that ignores a closed pipe and escapes control characters.

    Args:
        stream: The stream to replace.
        duplicate: Write through a duplicated descriptor, so that foreign code that closes or
            redirects the original one does not affect the stream.

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
    """Return a stream to the same file that writes control characters.

    It is for text without foreign parts.
    """
    return getattr(stream, "unescaped", stream)


class ForeignOutput:
    """Reader of a pipe that forwards output to standard error, escaped and limited.

    It forwards up to `MAX_OUTPUT_SIZE` bytes.
    """

    def __init__(self, reader: int):
        """Make the pipe non-blocking; `reader` is its descriptor."""
        os.set_blocking(reader, False)
        self._reader, self._size = reader, 0
        self._decode = codecs.getincrementaldecoder("utf-8")("replace").decode

    @property
    def dropped(self) -> int:
        """Number of bytes that were not forwarded."""
        return max(0, self._size - MAX_OUTPUT_SIZE)

    def forward(self) -> bool:
        """Forward the output that has arrived.

        Return False if the other end of the pipe is closed.
        """
        for _ in range(_MAX_READS):
            try:
                data = os.read(self._reader, _READ_SIZE)
            except BlockingIOError:
                return True
            if not data:
                return False
            remaining = max(0, MAX_OUTPUT_SIZE - self._size)
            self._size += len(data)
            if remaining:
                sys.stderr.write(
                    escape_control_characters(self._decode(data[:remaining]), keep=f"\n{SPACES}")
                )
                sys.stderr.flush()
        return True
