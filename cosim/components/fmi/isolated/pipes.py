"""Messages between importer and worker: one line of JSON each, for neither may run code that the other sends."""

from __future__ import annotations

import json
import os
import select
from collections.abc import Iterable
from typing import Any

#: the command to take a turn, and the answer that all is well, are the same empty line
TURN = DONE = b"\n"

#: bytes of one read
PIECE = 1 << 16

#: so often a descriptor is looked at before sleep (0.3 us each)
LOOKS = 40
#: so often at most sleep comes at once after looking was in vain
MOST_SLEEPS = 512


def encode(message: Any) -> bytes:
    return json.dumps(message, default=_plain).encode() + b"\n"


def decode(line: bytes) -> Any:
    """Raises ValueError for anything but JSON."""
    return json.loads(line, object_hook=_restored)


def _plain(value: Any) -> Any:
    return {"bytes": value.hex()} if isinstance(value, bytes) else value.tolist()


def _restored(value: dict[str, Any]) -> Any:
    return bytes.fromhex(value["bytes"]) if value.keys() == {"bytes"} else value


class Vigil:
    """Waits for descriptors that will soon be ready, awake for a moment: falling asleep and being woken costs more.

    Where that was in vain, because the other process has more to do or no processor of its own, it sleeps at once the next time,
    and twice as often after each further time.
    """

    def __init__(self, descriptors: Iterable[int]):
        self._poll = select.poll()
        for descriptor in descriptors:
            self._poll.register(descriptor, select.POLLIN)
        self.forget = self._poll.unregister
        self._sleeps, self._next_sleeps = 0, 1

    def wait(self, milliseconds: float) -> list[tuple[int, int]]:
        """What is ready, at the latest after this time."""
        return self._awake() or self._poll.poll(milliseconds)

    def read(self, reader: int) -> bytes:
        """What can be read, sooner or later."""
        self._awake()
        return os.read(reader, PIECE)

    def _awake(self) -> list[tuple[int, int]]:
        if self._sleeps:
            self._sleeps -= 1
            return []
        poll = self._poll.poll
        for _ in range(LOOKS):
            if ready := poll(0):
                self._next_sleeps = 1
                return ready
        self._sleeps, self._next_sleeps = self._next_sleeps, min(2 * self._next_sleeps, MOST_SLEEPS)
        return []


def read_line(reader: int, vigil: Vigil) -> bytes:
    """The next command; empty when there is nobody any more who could send one."""
    line = vigil.read(reader)
    while line[-1:] != b"\n" and line:
        line += os.read(reader, PIECE)
    return line


def write(writer: int, line: bytes) -> None:
    """Write the whole line."""
    while (written := os.write(writer, line)) < len(line):
        line = line[written:]
