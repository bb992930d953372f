"""Messages between importer and worker: one line of JSON each, for neither may run code that the other sends."""

from __future__ import annotations

import json
import os
import select
from collections.abc import Iterable
from typing import Any

from ....core.json_values import decode_object, encode_value

#: the command to take a turn, and the answer that all is well, are the same empty line
STEP_COMMAND = STEP_DONE = b"\n"

#: bytes of one read
READ_SIZE = 1 << 16

#: so often a descriptor is looked at before sleep (0.3 us each)
SPIN_COUNT = 40
#: so often at most sleep comes at once after looking was in vain
MAX_SPIN_BACKOFF = 512


def encode_line(message: Any) -> bytes:
    return json.dumps(message, default=encode_value).encode() + b"\n"


def decode_line(line: bytes) -> Any:
    """Raises ValueError for anything but JSON."""
    return json.loads(line, object_hook=decode_object)


class SpinningPoller:
    """Waits for descriptors that will soon be ready, awake for a moment: falling asleep and being woken costs more.

    Where that was in vain, because the other process has more to do or no processor of its own, it sleeps at once the next time,
    and twice as often after each further time.
    """

    def __init__(self, descriptors: Iterable[int]):
        self._poll = select.poll()
        for descriptor in descriptors:
            self._poll.register(descriptor, select.POLLIN)
        self.unregister = self._poll.unregister
        self._spins_to_skip, self._next_backoff = 0, 1

    def wait(self, milliseconds: float) -> list[tuple[int, int]]:
        """What is ready, at the latest after this time."""
        return self._spin() or self._poll.poll(milliseconds)

    def read(self, reader: int) -> bytes:
        """What can be read, sooner or later."""
        self._spin()
        return os.read(reader, READ_SIZE)

    def _spin(self) -> list[tuple[int, int]]:
        if self._spins_to_skip:
            self._spins_to_skip -= 1
            return []
        poll = self._poll.poll
        for _ in range(SPIN_COUNT):
            if ready := poll(0):
                self._next_backoff = 1
                return ready
        self._spins_to_skip, self._next_backoff = self._next_backoff, min(2 * self._next_backoff, MAX_SPIN_BACKOFF)
        return []


def read_line(reader: int, vigil: SpinningPoller) -> bytes:
    """The next command; empty when there is nobody any more who could send one."""
    line = vigil.read(reader)
    while line[-1:] != b"\n" and line:
        line += os.read(reader, READ_SIZE)
    return line


def write_line(writer: int, line: bytes) -> None:
    """Write the whole line."""
    while (written := os.write(writer, line)) < len(line):
        line = line[written:]
