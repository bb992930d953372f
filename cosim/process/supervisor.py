"""Runs a function in a child process and says what became of it: whatever foreign code does there, this process survives.

The child notes in a journal in shared memory what it is doing, so a crash, an exit or a hang is attributed to the component
and function that were called, at no cost per step. The rows it records lie in a file.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import resource
import select
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path

from ..core.errors import ComponentError, join_alternatives
from . import journal as journals
from .journal import CALL_NUMBER, CHANGE_COUNT, EXIT_CODE, ROW_COUNT, STEP_COUNT, Journal, Phase
from .run_files.folder import read_header
from .run_files.live_csv_writer import LiveCsvWriter
from .sandbox.limits import detach, lower_limit
from .standard_streams import ignoring_broken_pipe
from .temporary_folders import temporary_run_folder

#: the supervisor looks after the child this often (s)
POLL_INTERVAL = 0.05

#: after an interrupt the child has this long to come to an end (s)
INTERRUPT_TIMEOUT = 3.0

#: so much of what components print is passed on (bytes)
MAX_OUTPUT_SIZE = 1 << 16

#: a supervised run may have so much memory of its own (bytes); files of rows do not count
MEMORY_LIMIT = 4 << 30

#: orphans of orphans are looked for so often
_MAX_ORPHAN_SCANS = 10

_TERMINATION_SIGNALS = (signal.SIGTERM, signal.SIGHUP)
_PR_SET_CHILD_SUBREAPER = 36


@dataclass(frozen=True)
class SupervisedOutcome:
    """What became of the child: its exit code, or the failure that ended it; `rows` were recorded.

    `warning`: something failed when all results had been written. `interrupted`: the user ended a child that could not end in
    order. `journal` is what the child left.
    """

    exit_code: int
    row_count: int
    journal: Journal
    failure: ComponentError | None = None
    warning: str = ""
    interrupted: bool = False


def can_supervise() -> bool:
    """Whether this process can fork, and prints to files that a child can share (those of a test or a notebook are none)."""
    try:
        return hasattr(os, "fork") and sys.stdout.fileno() >= 0 and sys.stderr.fileno() >= 0
    except (OSError, AttributeError):
        return False


def run_supervised(
    entry: Callable[[], int], alongside: Callable[[Journal], AbstractContextManager[object]] = nullcontext
) -> SupervisedOutcome:
    """Run `entry` in a child process that keeps a journal (see `journal.current`); it returns an exit code and never raises.

    `beside` is what this process does meanwhile, from the birth of the child to its end.
    """
    journal = Journal(mmap.mmap(-1, journals.JOURNAL_SIZE))
    _adopt_orphans()
    with temporary_run_folder() as folder, interrupt_on_termination():
        sys.stdout.flush()
        sys.stderr.flush()
        reader, writer = os.pipe()
        supervisor = os.getpid()
        child = os.fork()
        if child == 0:
            os.close(reader)
            _run_child(entry, journal, writer, folder, supervisor)
        os.close(writer)
        with alongside(journal):
            return _Supervisor(child, journal, reader).wait_for_child()


@contextmanager
def interrupt_on_termination() -> Iterator[None]:
    """Within the block a closed terminal, or a service manager that ends the run, counts as an interrupt by the user."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    former = {number: signal.signal(number, signal.default_int_handler) for number in _TERMINATION_SIGNALS}
    try:
        yield
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


def _adopt_orphans() -> None:
    """Processes that lose their parent below us become our children, so that they can be found and ended."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)


# -- in the child ------------------------------------------------------------------------------------------------------------


def _run_child(entry: Callable[[], int], journal: Journal, foreign_output: int, temporary: str, supervisor: int) -> None:
    code = 70
    try:
        _isolate_child(foreign_output, supervisor)
        tempfile.tempdir = os.environ["TMPDIR"] = temporary
        journals.set_current_journal(journal)
        code = entry()
        sys.stdout.flush()
        sys.stderr.flush()
        journal[EXIT_CODE] = code
        journal.enter_phase(Phase.DONE)
    finally:
        os._exit(code)  # foreign code has no say in the end of the process


def _isolate_child(foreign_output: int, supervisor: int) -> None:
    """A session of its own that ends with the supervisor, nothing to read, and a pipe for what foreign code prints.

    Memory is limited, so that a component that never has enough ends alone, and core files are not written.
    """
    detach(supervisor)
    lower_limit(resource.RLIMIT_DATA, MEMORY_LIMIT)
    lower_limit(resource.RLIMIT_CORE, 0)
    sys.stdout, sys.stderr = ignoring_broken_pipe(sys.stdout, duplicate=True), ignoring_broken_pipe(sys.stderr, duplicate=True)
    os.dup2(foreign_output, 1)
    os.dup2(foreign_output, 2)
    os.close(foreign_output)


# -- in the supervisor -------------------------------------------------------------------------------------------------------


@dataclass
class _Supervisor:
    child: int
    journal: Journal
    reader: int
    _progress: tuple[int, ...] = ()
    _progress_time: float = field(default_factory=time.monotonic)
    _interrupt_time: float = 0.0
    _foreign_bytes: int = 0
    _timeout_reason: str = ""
    #: what the journal said when it was looked at last
    _last_contents: bytes = b""

    def wait_for_child(self) -> SupervisedOutcome:
        """Until the child has ended."""
        os.set_blocking(self.reader, False)
        process = os.pidfd_open(self.child) if hasattr(os, "pidfd_open") else -1
        poll = select.poll()
        for descriptor in (self.reader, process):
            if descriptor >= 0:
                poll.register(descriptor, select.POLLIN)
        csv = LiveCsvWriter(self.journal)
        try:
            status = self._poll_child(poll, csv)
        finally:
            self._kill_descendants()
            self._forward_output()
            os.close(self.reader)
            if process >= 0:
                os.close(process)
        return self._outcome(status)

    def _poll_child(self, poll: select.poll, csv: LiveCsvWriter) -> int:
        while True:
            try:
                poll.poll(POLL_INTERVAL * 1000)
                self._forward_output()
                pid, status = os.waitpid(self.child, os.WNOHANG)
                if pid:
                    return status
                self._check_deadline()
                csv.update()
            except KeyboardInterrupt:
                self._forward_interrupt()

    def _check_deadline(self) -> None:
        """End a child that takes longer than it may, or whose journal was overwritten."""
        journal, now = self.journal, time.monotonic()
        if not journal.is_valid:
            os.kill(self.child, signal.SIGKILL)
            return
        self._last_contents = journal.to_bytes()
        deadline = journal.deadline  # before `seen`: a deadline that is newer than `seen` would be another call's
        seen = journal[CHANGE_COUNT], journal[STEP_COUNT], journal[CALL_NUMBER]
        if seen != self._progress:
            self._progress, self._progress_time = seen, now
        elif now - self._progress_time > deadline:
            self._timeout_reason = f"did not return within {deadline:g} s"
            os.kill(self.child, signal.SIGKILL)
        if self._interrupt_time and now - self._interrupt_time > INTERRUPT_TIMEOUT:
            os.kill(self.child, signal.SIGKILL)

    def _forward_interrupt(self) -> None:
        """The first interrupt asks the child to end, the second one does not ask."""
        with suppress(ProcessLookupError):
            os.kill(self.child, signal.SIGKILL if self._interrupt_time else signal.SIGINT)
        self._interrupt_time = self._interrupt_time or time.monotonic()

    def _kill_descendants(self) -> None:
        """Processes that the child has left behind end with it, also those that left its session."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.child, signal.SIGKILL)
        for _ in range(_MAX_ORPHAN_SCANS):
            orphans = _child_processes()
            if not orphans:
                return
            for orphan in orphans:
                with suppress(ProcessLookupError, ChildProcessError):
                    os.kill(orphan, signal.SIGKILL)
                    os.waitpid(orphan, 0)

    def _forward_output(self) -> None:
        """What foreign code printed goes to standard error, up to a limit."""
        for _ in range(64):
            try:
                data = os.read(self.reader, 1 << 16)
            except BlockingIOError:
                return
            if not data:
                return
            room = MAX_OUTPUT_SIZE - self._foreign_bytes
            self._foreign_bytes += len(data)
            if room > 0:
                sys.stderr.write(data[:room].decode("utf-8", "replace"))
                sys.stderr.flush()

    def _outcome(self, status: int) -> SupervisedOutcome:
        if (more := self._foreign_bytes - MAX_OUTPUT_SIZE) > 0:
            sys.stderr.write(f"\n... components printed {more} bytes more\n")
        journal = self.journal
        if not journal.is_valid:
            journal.restore(self._last_contents)
            return SupervisedOutcome(
                1,
                journal[ROW_COUNT],
                journal,
                self._unattributed_failure("it wrote over memory of the process that is not its own"),
            )
        code, rows, phase = journal[EXIT_CODE], journal[ROW_COUNT], journal.phase
        if phase == Phase.DONE:
            return SupervisedOutcome(code, rows, journal)
        if self._interrupt_time:
            return SupervisedOutcome(130, rows, journal, interrupted=True)
        failure = self._attribute_failure(self._timeout_reason or describe_exit_status(status))
        if phase == Phase.RESULTS_WRITTEN:
            return SupervisedOutcome(code, rows, journal, warning=f"{failure}; all results were written before")
        return SupervisedOutcome(1, rows, journal, failure)

    def _attribute_failure(self, reason: str) -> ComponentError:
        """The failure of whatever was going on."""
        journal = self.journal
        header = read_header(journal.folder)
        if journal.phase == Phase.STEPPING and header:
            number, time = journal[CALL_NUMBER], header.time_at(journal[STEP_COUNT])
            component, function = header.calls[number] if 0 <= number < len(header.calls) else ("the run", "moving values")
            return ComponentError(component, function, reason, time)
        if journal.phase in (Phase.CALLING, Phase.RESULTS_WRITTEN):
            activity = journal.activity()
            moment = None if activity.time != activity.time else activity.time
            return ComponentError(activity.component, activity.function, reason, moment)
        return self._unattributed_failure(f"{reason}, while no component was being called")

    def _unattributed_failure(self, reason: str) -> ComponentError:
        """The failure of a component that cannot be told from the others."""
        header = read_header(self.journal.folder)
        names = dict.fromkeys(component for component, _ in header.calls) if header else {}
        return ComponentError(join_alternatives(names) if names else "cosim", "the run", reason)


def _child_processes() -> list[int]:
    try:
        return [int(word) for word in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()]
    except OSError:
        return []


def describe_exit_status(status: int) -> str:
    """How a process ended, in words."""
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        name = signal.Signals(number).name if number in set(signal.Signals) else "unknown"
        text = f"the process was ended by signal {number} ({name}, {(signal.strsignal(number) or '').lower()})"
        return f"{text}: out of memory, or killed from outside" if number == signal.SIGKILL else text
    return f"it ended the process with exit code {os.WEXITSTATUS(status)}"
