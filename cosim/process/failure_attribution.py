"""Attribution of the failure of a process to the component that was running."""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Sequence

from ..core.errors import ComponentError, join_alternatives
from .journal import CALL_NUMBER, Journal, Phase
from .run_files import RowsFile


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
        text = (
            f"the process was ended by signal {number} ({name}, "
            f"{(signal.strsignal(number) or '').lower()})"
        )
        return (
            f"{text}: out of memory, or killed from outside" if number == signal.SIGKILL else text
        )
    return f"it ended the process with exit code {os.WEXITSTATUS(status)}"


def _calls_of_run(journal: Journal) -> Sequence[tuple[str, str]] | None:
    """Return component and function of each call of the stepping loop; None before it begins."""
    rows_file = RowsFile.open(journal.folder) if journal.folder else None
    return rows_file.layout.calls if rows_file else None
