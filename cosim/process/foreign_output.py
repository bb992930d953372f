"""Output of foreign code, which arrives through a pipe."""

from __future__ import annotations

import codecs
import os
import sys

from ..core.text import SPACES, escape_control_characters

#: output of foreign code that is forwarded (bytes)
MAX_OUTPUT_SIZE = 1 << 16

_READ_SIZE = 1 << 16
#: largest number of reads at once, which bounds the time away from other work
_MAX_READS = 64


class ForeignOutput:
    """Reader of a pipe that forwards output to standard error, escaped and up to `MAX_OUTPUT_SIZE`."""

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
