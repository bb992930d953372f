"""Python stack of a supervised child: its signal handlers write it when it crashes or when the supervisor requests it."""

from __future__ import annotations

import faulthandler
import fcntl
import os
import re
import signal
import time
from contextlib import suppress
from itertools import takewhile
from pathlib import Path

from ..core.user_code import innermost_user_line, is_cosim_file

_FILE = "python_stack"
_REQUEST_SIGNAL = signal.SIGUSR2
#: lowest descriptor of the file, so that later files do not get its number if foreign code closes it
_MIN_DESCRIPTOR = 200
#: maximum time for which the supervisor waits for a requested stack, and interval at which it looks (s)
_MAX_WAIT, _WAIT_INTERVAL = 0.3, 0.01
_FRAME = re.compile(r'^  File "(.*)", line (\d+) in ', re.MULTILINE)


def write_stack_on_signals(folder: str) -> None:
    """Write the stack of the running thread to a file in `folder` upon fatal signals and `request_stack`.

    Does nothing if no file can be opened.
    """
    with suppress(OSError), open(Path(folder) / _FILE, "wb") as file:  # noqa: PTH123 - the descriptor is duplicated
        descriptor = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, _MIN_DESCRIPTOR)
        faulthandler.enable(descriptor, all_threads=False)
        faulthandler.register(_REQUEST_SIGNAL, descriptor, all_threads=False)


def request_stack(process: int, folder: str) -> None:
    """Make the process write its stack, and wait until it has done so.

    A process that ignores the signal writes nothing. One that has no handler for it ends.
    """
    with suppress(ProcessLookupError):
        os.kill(process, _REQUEST_SIGNAL)
    end, size = time.monotonic() + _MAX_WAIT, -1
    while time.monotonic() < end and not 0 < size == _size(folder):
        size = _size(folder)
        time.sleep(_WAIT_INTERVAL)


def _size(folder: str) -> int:
    with suppress(OSError):
        return (Path(folder) / _FILE).stat().st_size
    return 0


def innermost_line(folder: str) -> str:
    """Return " (file:line)" of the user's Python code that was running when the stack was written; "" if none was running."""
    with suppress(OSError):
        text = (Path(folder) / _FILE).read_text(errors="replace")
        frames = [(match[1], int(match[2])) for match in _FRAME.finditer(text)]
        # frames outside those of cosim belong to a program that called cosim
        called = takewhile(lambda frame: not is_cosim_file(frame[0]), frames)
        if line := innermost_user_line(called):
            return f" ({line})"
    return ""
