"""Messages between importer and worker: one line of JSON each, for neither may run code that the other sends."""

from __future__ import annotations

import json
import os
from typing import Any

#: the command to take a turn, and the answer that all is well, are the same empty line
TURN = DONE = b"\n"

#: bytes of one read
PIECE = 1 << 16


def encode(message: Any) -> bytes:
    return json.dumps(message, default=_plain).encode() + b"\n"


def decode(line: bytes) -> Any:
    """Raises ValueError for anything but JSON."""
    return json.loads(line, object_hook=_restored)


def _plain(value: Any) -> Any:
    return {"bytes": value.hex()} if isinstance(value, bytes) else value.tolist()


def _restored(value: dict[str, Any]) -> Any:
    return bytes.fromhex(value["bytes"]) if value.keys() == {"bytes"} else value


def read_line(reader: int) -> bytes:
    """The next command; empty when there is nobody any more who could send one."""
    line = os.read(reader, PIECE)
    while line[-1:] != b"\n" and line:
        line += os.read(reader, PIECE)
    return line


def write(writer: int, line: bytes) -> None:
    """Write the whole line."""
    while (written := os.write(writer, line)) < len(line):
        line = line[written:]
