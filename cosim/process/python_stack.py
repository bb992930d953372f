"""Python stack of a supervised child.

Its signal handlers write it when it crashes or when the supervisor requests it.
"""

from __future__ import annotations

import faulthandler
import fcntl
import os
import re
import signal
import time
from contextlib import suppress
from itertools import takewhile

from ..core.user_code import innermost_user_line, is_cosim_file

_REQUEST_SIGNAL = signal.SIGUSR2
#: lowest descriptor of the file in the child, so that later files do not get its number if foreign
#: code closes it
_MIN_DESCRIPTOR = 200
#: maximum time for which the supervisor waits for a requested stack, and interval at which it looks
#: (s)
_MAX_WAIT, _WAIT_INTERVAL = 0.3, 0.01
#: largest number of bytes read (foreign code can write to the file too)
_MAX_SIZE = 1 << 16
_FRAME = re.compile(r'^  File "(.*)", line (\d+) in ', re.MULTILINE)


def write_stack_on_signals(file: int) -> None:
    """Write the stack of the running thread to an open file upon fatal signals and `request_stack`.

    Does nothing if the process has no descriptor left.
    """
    with suppress(OSError):
        descriptor = fcntl.fcntl(file, fcntl.F_DUPFD_CLOEXEC, _MIN_DESCRIPTOR)
        faulthandler.enable(descriptor, all_threads=False)
        faulthandler.register(_REQUEST_SIGNAL, descriptor, all_threads=False)


def request_stack(process: int, file: int) -> None:
    """Make the process write its stack to the file, and wait until it has done so.

    A process that ignores the signal writes nothing. One that has no handler for it ends.
    """
    with suppress(ProcessLookupError):
        os.kill(process, _REQUEST_SIGNAL)
    end, size = time.monotonic() + _MAX_WAIT, -1
    while time.monotonic() < end and not 0 < size == os.fstat(file).st_size:
        size = os.fstat(file).st_size
        time.sleep(_WAIT_INTERVAL)


def innermost_line(file: int) -> str:
    """Return " (file:line)" of the user's Python code that was running when the stack was written.

    "" if none was running.
    """
    text = os.pread(file, _MAX_SIZE, 0).decode(errors="replace")
    frames = [(match[1], int(match[2])) for match in _FRAME.finditer(text)]
    # frames outside those of cosim belong to a program that called cosim
    called = takewhile(lambda frame: not is_cosim_file(frame[0]), frames)
    line = innermost_user_line(called)
    return f" ({line})" if line else ""
