"""Attribution of the failure of a process to the component and the line that were running.

The journal names the component. The line comes from the Python stack, which signal handlers of the
process write to a file when it crashes or when the supervisor requests it.
"""

import faulthandler
import fcntl
import math
import os
import re
import signal
import time
from collections.abc import Sequence
from contextlib import suppress
from itertools import takewhile

from ..core.errors import ComponentError, innermost_user_line, is_cosim_file, join_alternatives
from .journal import CALL_NUMBER, Journal, Phase
from .run_files import RowsFile

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


def attribute_failure(journal: Journal, reason: str) -> ComponentError:
    """Return the failure of the call that the journal records as the present one.

    Args:
        journal: Journal of the process that failed.
        reason: Description of the failure.
    """
    calls = _calls_of_run(journal)
    if journal.phase == Phase.STEPPING and calls is not None:
        number = journal[CALL_NUMBER]
        known = 0 <= number < len(calls)
        component, function = calls[number] if known else ("the run", "moving values")
        return ComponentError(component, function, reason, journal.step_time)
    if journal.phase in (Phase.CALLING, Phase.RESULTS_WRITTEN):
        activity = journal.activity()
        return ComponentError(
            activity.component,
            activity.function,
            reason,
            None if math.isnan(activity.time) else activity.time,
        )
    return unattributed_failure(journal, f"{reason}, while no component was being called")


def unattributed_failure(journal: Journal, reason: str) -> ComponentError:
    """Return a failure that any component of the run may have caused.

    Args:
        journal: Journal of the process that failed.
        reason: Description of the failure.
    """
    names = dict.fromkeys(component for component, _ in _calls_of_run(journal) or ())
    return ComponentError(join_alternatives(names) if names else "cosim", "the run", reason)


def describe_exit_status(status: int) -> str:
    """Return in words how a process ended, from the status of `os.waitpid`."""
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        name = signal.Signals(number).name if number in set(signal.Signals) else "unknown"
        cause = ": out of memory, or killed from outside" if number == signal.SIGKILL else ""
        return (
            f"the process was ended by signal {number} ({name}, "
            f"{(signal.strsignal(number) or '').lower()}){cause}"
        )
    return f"it ended the process with exit code {os.WEXITSTATUS(status)}"


def _calls_of_run(journal: Journal) -> Sequence[tuple[str, str]] | None:
    """Return component and function of each call of the stepping loop; None before it begins."""
    rows_file = RowsFile.open(journal.folder) if journal.folder else None
    return rows_file.layout.calls if rows_file else None


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
