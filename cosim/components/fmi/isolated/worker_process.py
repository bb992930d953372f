"""Start, supervision and end of a worker process, in the importer process."""

import os
import select
import signal
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import NoReturn

from ....core import component_log
from ....process.failure_attribution import describe_exit_status
from ....process.journal import (
    CALL_NUMBER,
    CHANGE_COUNT,
    Journal,
    attributing_forks,
    suspending_deadline,
)
from ....process.limits import skip_exit_handlers
from ....process.standard_streams import ForeignOutput
from ....process.supervisor import POLL_INTERVAL
from .pipe_messages import (
    INVALID_ANSWER_ERRORS,
    READ_SIZE,
    STEP_DONE,
    SpinningPoller,
    decode_line,
    write_line,
)

#: wait (ms) that still counts for the deadline of the run's own supervisor
_SHORT_WAIT = 20
#: time (s) for a worker process that closed its pipes to exit
_EXIT_TIMEOUT = 0.5
#: smallest descriptor above the limit that the sandbox sets for open files
_FIRST_RESERVED_DESCRIPTOR = 256
#: largest accepted answer (bytes)
_MAX_ANSWER_SIZE = 1 << 26
#: reason why a worker process is stopped after an answer that it would not send by itself
INVALID_ANSWER = "its worker process sent an invalid answer"
_LOG_LEVELS = (component_log.INFO, component_log.WARNING, component_log.ERROR)
#: exit code of a worker process that raised an exception outside a command
_INTERNAL_ERROR = 70


class WorkerLostError(Exception):
    """Reason why a worker process ended or has to be stopped."""


class WorkerProcess:
    """Worker process that answers commands with one line each and keeps a journal in shared memory.

    Its standard output and standard error are forwarded to the importer's standard error, up to a
    limit.
    """

    def __init__(self, name: str, journal: Journal, serve: Callable[[int, int], None]):
        """Fork the worker process.

        Args:
            name: Name of the component, for messages.
            journal: Journal of the worker process.
            serve: Function that runs in the worker process, given the descriptors of commands and
                answers.
        """
        self._name, self._journal = name, journal
        commands, self._writer = os.pipe()
        self._reader, answers = os.pipe()
        self._output, output_writer = os.pipe()
        with attributing_forks(None):
            self._pid = os.fork()
            if self._pid == 0:
                _run_worker(serve, commands, answers, output_writer)
        for descriptor in (commands, answers, output_writer):
            os.close(descriptor)
        self._foreign_output = ForeignOutput(self._output)
        self._pidfd = os.pidfd_open(self._pid) if hasattr(os, "pidfd_open") else -1
        self._poller = SpinningPoller(
            descriptor
            for descriptor in (self._reader, self._output, self._pidfd)
            if descriptor >= 0
        )
        self._descriptors = [
            d for d in (self._writer, self._reader, self._output, self._pidfd) if d >= 0
        ]
        self._answer_event = [(self._reader, select.POLLIN)]
        self._received = b""

    def request(self, line: bytes, deadline: float) -> bytes:
        """Send a command and wait for its answer.

        Args:
            line: The command.
            deadline: Largest wall time (s) of each FMI call that the command makes.

        Returns:
            The answer, a line.

        Raises:
            WorkerLostError: The worker process has ended, exceeded the deadline or sent too much.
        """
        if (
            self._received and self._take_answer() is not None
        ):  # before the command to which it would be the answer
            raise WorkerLostError(INVALID_ANSWER)
        try:
            write_line(self._writer, line)
            if self._poller.wait(_SHORT_WAIT) == self._answer_event:
                data = os.read(self._reader, READ_SIZE)
                if data == STEP_DONE and not self._received:
                    return STEP_DONE
                self._received += data
            with suspending_deadline():
                return self._wait_for_answer(deadline)
        except BrokenPipeError:
            raise self._lost_error() from None

    def _wait_for_answer(self, deadline: float) -> bytes:
        """Wait for an answer.

        Each FMI call that the worker's journal records restarts the deadline.
        """
        last_progress, since = self._progress(), time.monotonic()
        while True:
            if (answer := self._take_answer()) is not None:
                return answer
            if (progress := self._progress()) != last_progress:
                last_progress, since = progress, time.monotonic()
            elif time.monotonic() - since > deadline:
                raise WorkerLostError(f"did not return within {deadline:g} s")
            ready = dict(self._poller.wait(min(POLL_INTERVAL, deadline) * 1000))
            if self._output in ready:
                self._forward_output()
            if self._reader in ready:
                data = os.read(self._reader, READ_SIZE)
                self._received += data
                if not data:
                    raise self._lost_error()
                if len(self._received) > _MAX_ANSWER_SIZE:
                    raise WorkerLostError(
                        f"its worker process sent more than {_MAX_ANSWER_SIZE} bytes at once"
                    )
            elif self._pidfd in ready:
                raise self._lost_error()

    def _progress(self) -> tuple[int, int]:
        return self._journal[CHANGE_COUNT], self._journal[CALL_NUMBER]

    def _take_answer(self) -> bytes | None:
        """Return the answer if it has arrived, after forwarding the log messages before it."""
        *lines, self._received = self._received.split(b"\n")
        for index, line in enumerate(lines):
            if not self._forward_log_message(line):
                self._received = b"\n".join([*lines[index + 1 :], self._received])
                return line + b"\n"
        return None

    def _forward_log_message(self, line: bytes) -> bool:
        """Log the message if the line contains one; return whether it does."""
        if not line.startswith(b'{"log"'):
            return False
        try:
            level, text = decode_line(line)["log"]
        except INVALID_ANSWER_ERRORS:
            raise WorkerLostError(INVALID_ANSWER) from None
        if level not in _LOG_LEVELS:
            raise WorkerLostError(INVALID_ANSWER)
        component_log.log_message(self._name, level, str(text))
        return True

    def _lost_error(self) -> WorkerLostError:
        status = self._reap(_EXIT_TIMEOUT)
        if status is None:
            return WorkerLostError("its worker process closed the connection to the importer")
        return WorkerLostError(describe_exit_status(status))

    def _forward_output(self) -> None:
        if not self._foreign_output.forward():
            self._poller.unregister(self._output)

    def _reap(self, timeout: float) -> int | None:
        """Wait up to `timeout` s for the process to end, then kill its process group.

        Return its status or None.
        """
        end = time.monotonic() + timeout
        while self._pid:
            if os.waitid(os.P_PID, self._pid, os.WEXITED | os.WNOHANG | os.WNOWAIT):
                with suppress(ProcessLookupError, PermissionError):
                    os.killpg(self._pid, signal.SIGKILL)
                _, status = os.waitpid(self._pid, 0)
                self._pid = 0
                return status
            if time.monotonic() >= end:
                return None
            time.sleep(0.001)
        return None

    def stop(self, timeout: float = 0.0) -> None:
        """Stop the process and close its pipes.

        Args:
            timeout: Time (s) for the process to exit before it is killed.
        """
        if self._pid and self._reap(timeout) is None:
            os.kill(self._pid, signal.SIGKILL)
            self._reap(float("inf"))
        if not self._descriptors:
            return
        with suppress(KeyError):
            self._forward_output()
        if dropped := self._foreign_output.dropped:
            component_log.log_message(
                self._name, component_log.WARNING, f"printed {dropped} bytes more"
            )
        while self._descriptors:
            os.close(self._descriptors.pop())


def _run_worker(
    serve: Callable[[int, int], None], commands: int, answers: int, output: int
) -> NoReturn:
    """Run the worker process, from the fork to its exit."""
    code = _INTERNAL_ERROR
    _streams = (
        sys.stdout,
        sys.stderr,
    )  # kept alive, because deleting them would write the importer's buffered output again
    try:
        skip_exit_handlers()
        commands, answers, output = map(
            _duplicate_above_limit, (commands, answers, output)
        )  # they may be standard streams
        os.dup2(output, 1)
        os.dup2(output, 2)
        _close_other_descriptors({0, 1, 2, commands, answers})
        sys.stdout, sys.stderr = (
            os.fdopen(n, "w", buffering=1, errors="replace", closefd=False) for n in (1, 2)
        )
        serve(commands, answers)
        code = 0
    finally:
        os._exit(code)  # runs no exit handlers, neither of the importer nor of foreign code


def _duplicate_above_limit(descriptor: int) -> int:
    """Duplicate a descriptor to a number above the limit of open files.

    Code that closes all files does not reach it.
    """
    import fcntl
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    lowest = (
        _FIRST_RESERVED_DESCRIPTOR if soft > 2 * _FIRST_RESERVED_DESCRIPTOR else max(descriptor, 3)
    )
    return fcntl.fcntl(descriptor, fcntl.F_DUPFD, lowest)


def _close_other_descriptors(keep_open: set[int]) -> None:
    try:
        descriptors = {int(path.name) for path in Path("/proc/self/fd").iterdir()}
    except OSError:
        descriptors = set(range(os.sysconf("SC_OPEN_MAX")))
    for descriptor in descriptors - keep_open:
        with suppress(OSError):
            os.close(descriptor)
