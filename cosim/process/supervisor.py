"""Supervision of a function that runs foreign code in a child process.

The child records its present call in a journal in shared memory. So a crash, an exit or a hang is
attributed to the component and function that were called, at no cost per step. The recorded rows
are in a file, which survives the child.
"""

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
from tempfile import TemporaryFile
from typing import NoReturn

from ..core.errors import ComponentError
from .failure_attribution import (
    attribute_failure,
    describe_exit_status,
    innermost_line,
    request_stack,
    unattributed_failure,
    write_stack_on_signals,
)
from .journal import (
    CALL_NUMBER,
    CHANGE_COUNT,
    EXIT_CODE,
    JOURNAL_SIZE,
    OVERWRITTEN,
    ROW_COUNT,
    STEP_COUNT,
    Journal,
    Phase,
    set_current_journal,
    watch_forks,
)
from .limits import detach, lower_limit, skip_exit_handlers
from .process_state import reserve_descriptors
from .process_status import child_processes, waiting_time
from .standard_streams import ForeignOutput, protected_stream
from .temporary_folders import temporary_run_folder

#: limit of the private memory of a supervised run (bytes); mapped files of rows do not count
MEMORY_LIMIT = 4 << 30

#: interval at which the supervisor checks the child (s)
POLL_INTERVAL = 0.05

#: time after an interrupt until the child is killed (s)
INTERRUPT_TIMEOUT = 3.0

#: time after which a process that was stopped from outside (SIGSTOP) is killed (s)
STOP_TIMEOUT = 5.0

#: largest ratio of the wall time of a call to its deadline, on a busy machine
MAX_EXTENSION = 4.0

#: number of searches for orphaned processes; each one may find children of the processes killed
#: before
_MAX_ORPHAN_SCANS = 10

_TERMINATION_SIGNALS = (signal.SIGTERM, signal.SIGHUP)
_PR_SET_CHILD_SUBREAPER = 36


@dataclass(frozen=True)
class SupervisedOutcome:
    """Outcome of a supervised child.

    Attributes:
        exit_code: Exit code of `entry`, or the one of the failure.
        row_count: Number of recorded rows.
        journal: Journal as the child left it.
        failure: Failure that ended the child; None if there was none.
        warning: Description of a failure after all results were written; "" if there was none.
        interrupted: The user interrupted the run and the child had to be killed.
    """

    exit_code: int
    row_count: int
    journal: Journal
    failure: ComponentError | None = None
    warning: str = ""
    interrupted: bool = False


def can_supervise() -> bool:
    """Return whether this process can fork and its standard streams have descriptors.

    They have none in a notebook and in some tests.
    """
    try:
        return hasattr(os, "fork") and sys.stdout.fileno() >= 0 and sys.stderr.fileno() >= 0
    except (OSError, AttributeError):
        return False


def run_supervised(
    entry: Callable[[], int],
    alongside: Callable[[Journal], AbstractContextManager[object]] = nullcontext,
) -> SupervisedOutcome:
    """Run a function in a child process with a journal.

    Args:
        entry: Returns an exit code and never raises.
        alongside: Makes a context manager that this process enters while the child runs.

    Returns:
        The outcome, also if the child crashed or was killed.
    """
    journal = Journal(mmap.mmap(-1, JOURNAL_SIZE))
    if sys.platform == "linux":  # orphaned descendants become children, which can be killed
        ctypes.CDLL(None).prctl(_PR_SET_CHILD_SUBREAPER, 1)
    with (
        temporary_run_folder() as folder,
        TemporaryFile(dir=folder) as stack,
        interrupt_on_termination(),
    ):
        sys.stdout.flush()
        sys.stderr.flush()
        reader, writer = os.pipe()
        supervisor = os.getpid()
        child = os.fork()
        if child == 0:
            os.close(reader)
            run_child(entry, journal, writer, stack.fileno(), folder, supervisor)
        os.close(writer)
        with alongside(journal):
            return _Supervisor(child, journal, reader, stack.fileno()).wait_for_child()


def run_child(
    entry: Callable[[], int],
    journal: Journal,
    output: int,
    stack: int,
    temporary_folder: str,
    supervisor: int,
) -> NoReturn:
    """Run `entry` in this process, which was just forked, and end the process.

    Args:
        entry: Returns the exit code.
        journal: Journal in memory that the supervisor reads.
        output: Descriptor of the pipe for the output of foreign code.
        stack: Descriptor of the file for the Python stack (see `failure_attribution`).
        temporary_folder: Folder for temporary files.
        supervisor: Process id of the supervisor.
    """
    code = 70
    try:
        skip_exit_handlers()
        _isolate(output, supervisor)
        write_stack_on_signals(stack)
        tempfile.tempdir = os.environ["TMPDIR"] = temporary_folder
        journal.exclude_from_forks()
        watch_forks()
        set_current_journal(journal)
        code = entry()
        sys.stdout.flush()
        sys.stderr.flush()
        journal[EXIT_CODE] = code
        journal.enter_phase(Phase.DONE)
    finally:
        os._exit(code)  # skips the exit handlers of foreign code


def _isolate(output: int, supervisor: int) -> None:
    """Enter a session that ends with the supervisor, and limit memory.

    Descriptors 1 and 2 become the pipe `output`.

    Python's own output goes to duplicates of the former descriptors. The limit keeps a component
    that allocates without end from affecting other processes. Core files are not written. Some
    descriptors are reserved for results.
    """
    detach(supervisor)
    lower_limit(resource.RLIMIT_DATA, MEMORY_LIMIT)
    lower_limit(resource.RLIMIT_CORE, 0)
    reserve_descriptors()
    sys.stdout, sys.stderr = (
        protected_stream(sys.stdout, duplicate=True),
        protected_stream(sys.stderr, duplicate=True),
    )
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)


@contextmanager
def interrupt_on_termination() -> Iterator[None]:
    """Raise KeyboardInterrupt on SIGTERM and SIGHUP inside the block.

    Does nothing outside the main thread.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handlers = {
        number: signal.signal(number, signal.default_int_handler) for number in _TERMINATION_SIGNALS
    }
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


@dataclass
class _Supervisor:
    """Supervision of a child process.

    Attributes:
        child: Process id.
        journal: Journal of the child.
        reader: Pipe with the output of foreign code.
        stack: File for the Python stack of the child (see `failure_attribution`).
    """

    child: int
    journal: Journal
    reader: int
    stack: int
    _output: ForeignOutput = field(init=False)
    _progress: tuple[int, ...] = ()
    _progress_time: float = field(default_factory=time.monotonic)
    #: see `waiting_time`, at the last progress (s)
    _waiting_time: float = 0.0
    _interrupt_time: float = 0.0
    #: time at which the child was stopped from outside; 0 while it runs
    _stop_time: float = 0.0
    _timeout_reason: str = ""
    _stop_failure: ComponentError | None = None
    #: content of the journal at the last check
    _last_contents: bytes = b""

    def wait_for_child(self) -> SupervisedOutcome:
        """Wait for the end of the child and return its outcome."""
        self._output = ForeignOutput(self.reader)
        process = os.pidfd_open(self.child) if hasattr(os, "pidfd_open") else -1
        poll = select.poll()
        for descriptor in (self.reader, process):
            if descriptor >= 0:
                poll.register(descriptor, select.POLLIN)
        try:
            status = self._poll_child(poll)
        finally:
            self._kill_descendants()
            self._output.forward()
            os.close(self.reader)
            if process >= 0:
                os.close(process)
        return self._outcome(status)

    def _poll_child(self, poll: select.poll) -> int:
        """Forward output and check the deadline until the child ends; return its status."""
        while True:
            try:
                poll.poll(POLL_INTERVAL * 1000)
                if not self._output.forward():
                    with suppress(KeyError):
                        poll.unregister(self.reader)  # a closed pipe is always ready
                pid, status = os.waitpid(self.child, os.WNOHANG | os.WUNTRACED | os.WCONTINUED)
                if pid and (os.WIFEXITED(status) or os.WIFSIGNALED(status)):
                    return status
                if pid:
                    self._stop_time = time.monotonic() if os.WIFSTOPPED(status) else 0.0
                self._check_deadline()
            except KeyboardInterrupt:  # the second one kills the child
                with suppress(ProcessLookupError):
                    number = signal.SIGKILL if self._interrupt_time else signal.SIGINT
                    os.kill(self.child, number)
                self._interrupt_time = self._interrupt_time or time.monotonic()

    def _check_deadline(self) -> None:
        """Kill a child that exceeds a deadline.

        Also one that has overwritten its journal, ignores an interrupt or was stopped from outside.
        """
        # A call is late if the journal shows no progress for longer than its deadline. Progress is
        # any change of the phase, of the step or of the call within the step, so that the deadline
        # holds for each call, although the child records nothing but these numbers.
        journal, now = self.journal, time.monotonic()
        if not journal.is_valid:
            os.kill(self.child, signal.SIGKILL)
            return
        self._last_contents = journal.to_bytes()
        # read before `progress`: a later deadline might belong to the next call
        deadline = journal.deadline
        progress = journal[CHANGE_COUNT], journal[STEP_COUNT], journal[CALL_NUMBER]
        if progress != self._progress:
            self._progress, self._progress_time = progress, now
            self._waiting_time = waiting_time(self.child)
        elif now - self._progress_time > deadline and self._exceeds(deadline, now):
            self._timeout_reason = f"did not return within {deadline:g} s"
            request_stack(self.child, self.stack)
            os.kill(self.child, signal.SIGKILL)
        if self._stop_time and now - self._stop_time > STOP_TIMEOUT:
            self._stop_failure = ComponentError(
                "cosim", "the run", f"its process was stopped from outside for {STOP_TIMEOUT:g} s"
            )
            os.kill(self.child, signal.SIGKILL)
        if self._interrupt_time and now - self._interrupt_time > INTERRUPT_TIMEOUT:
            os.kill(self.child, signal.SIGKILL)

    def _exceeds(self, deadline: float, now: float) -> bool:
        """Return whether a call exceeds a deadline (s).

        The time in which a busy machine gave it no processor does not count.
        """
        waiting = waiting_time(self.child) - self._waiting_time
        return (
            now - self._progress_time - waiting > deadline
            or now - self._progress_time > MAX_EXTENSION * deadline
        )

    def _kill_descendants(self) -> None:
        """Kill all processes that the child left behind, also those outside its session."""
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.child, signal.SIGKILL)
        for _ in range(_MAX_ORPHAN_SCANS):
            orphans = child_processes()
            if not orphans:
                return
            for orphan in orphans:
                with suppress(ProcessLookupError, ChildProcessError):
                    os.kill(orphan, signal.SIGKILL)
                    os.waitpid(orphan, 0)

    def _outcome(self, status: int) -> SupervisedOutcome:
        """Return the outcome of a child that ended with `status`."""
        if self._output.dropped:
            sys.stderr.write(f"\n... components printed {self._output.dropped} bytes more\n")
        journal = self.journal
        if not journal.is_valid:
            journal.restore(self._last_contents)
            failure = unattributed_failure(journal, OVERWRITTEN)
            return SupervisedOutcome(1, journal[ROW_COUNT], journal, failure)
        code, rows, phase = journal[EXIT_CODE], journal[ROW_COUNT], journal.phase
        if phase == Phase.DONE:
            return SupervisedOutcome(code, rows, journal)
        if self._interrupt_time:
            return SupervisedOutcome(130, rows, journal, interrupted=True)
        reason = (self._timeout_reason or describe_exit_status(status)) + innermost_line(self.stack)
        failure = self._stop_failure or attribute_failure(journal, reason)
        if phase == Phase.RESULTS_WRITTEN:
            return SupervisedOutcome(
                code, rows, journal, warning=f"{failure}; all results were written before"
            )
        return SupervisedOutcome(1, rows, journal, failure)
