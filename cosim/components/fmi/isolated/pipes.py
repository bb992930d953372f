"""Messages between the importer process and a worker process: lines of JSON through pipes.

JSON, unlike pickle, cannot make the receiver execute code of the sender.
"""

from __future__ import annotations

import json
import os
import select
from collections.abc import Iterable
from typing import Any

from ....core.json_values import decode_object, encode_value

#: the command to execute a prepared step, and the answer that it succeeded without a result: the
#: same empty line
STEP_COMMAND = STEP_DONE = b"\n"

#: bytes of one read
READ_SIZE = 1 << 16

#: polls without sleeping before a blocking wait (0.3 us each)
SPIN_COUNT = 40
#: largest number of waits without spinning after spinning was unsuccessful
MAX_SPIN_BACKOFF = 512


def encode_line(message: Any) -> bytes:
    """Return a message as one line of JSON; bytes and NumPy arrays are allowed in it."""
    return json.dumps(message, default=encode_value).encode() + b"\n"


def decode_line(line: bytes) -> Any:
    """Return the message in a line.

    Raises:
        ValueError: The line is not JSON.
    """
    return json.loads(line, object_hook=decode_object)


class SpinningPoller:
    """Poller that spins briefly before it sleeps, because sleeping and waking up take longer than most answers.

    Spinning is unsuccessful if the other process computes longer or has no free processor. The next waits then sleep at once.
    Their number doubles with each further unsuccessful spin.
    """

    def __init__(self, descriptors: Iterable[int]):
        self._poll = select.poll()
        for descriptor in descriptors:
            self._poll.register(descriptor, select.POLLIN)
        self.unregister = self._poll.unregister
        self._spins_to_skip, self._next_backoff = 0, 1

    def wait(self, milliseconds: float) -> list[tuple[int, int]]:
        """Wait until a descriptor is ready or the time has passed.

        Returns:
            Pairs (descriptor, event) as from `select.poll`.
        """
        return self._spin() or self._poll.poll(milliseconds)

    def read(self, reader: int) -> bytes:
        """Read the available bytes of a pipe, waiting for at least one."""
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
        self._spins_to_skip, self._next_backoff = (
            self._next_backoff,
            min(2 * self._next_backoff, MAX_SPIN_BACKOFF),
        )
        return []


def read_line(reader: int, poller: SpinningPoller) -> bytes:
    """Read the next line; empty if the other end of the pipe is closed."""
    line = poller.read(reader)
    while line[-1:] != b"\n" and line:
        line += os.read(reader, READ_SIZE)
    return line


def write_line(writer: int, line: bytes) -> None:
    """Write a whole line."""
    while (written := os.write(writer, line)) < len(line):
        line = line[written:]
