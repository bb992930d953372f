"""A worker process, seen from the importer."""

from __future__ import annotations

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
from ....process.journal import CALL_NUMBER, CHANGE_COUNT, Journal, suspending_deadline
from ....process.supervisor import MAX_OUTPUT_SIZE, POLL_INTERVAL
from .pipes import READ_SIZE, STEP_DONE, SpinningPoller, decode_line, write_line

#: so long (ms) a wait is a usual one, which the supervisor of the run looks after, too
_SHORT_WAIT = 20
#: a worker that closed its pipes has this long to end by itself (s)
_EXIT_TIMEOUT = 0.5
#: descriptors from here on are above the limit of a worker
_FIRST_RESERVED_DESCRIPTOR = 256
#: bytes of an answer at most
_MAX_ANSWER_SIZE = 1 << 26


class WorkerLost(Exception):
    """The worker is no longer there, or must not be; says why."""


class WorkerProcess:
    """A process that answers lines with lines and keeps a journal. What it prints goes to standard error, up to a limit.

    `serve` runs in it, with the descriptors where commands come from and answers go to.
    """

    def __init__(self, name: str, journal: Journal, serve: Callable[[int, int], None]):
        self._name, self._journal = name, journal
        commands, self._writer = os.pipe()
        self._reader, answers = os.pipe()
        self._output, printed = os.pipe()
        self._pid = os.fork()
        if self._pid == 0:
            _run_worker(serve, commands, answers, printed)
        for descriptor in (commands, answers, printed):
            os.close(descriptor)
        os.set_blocking(self._output, False)
        self._pidfd = os.pidfd_open(self._pid) if hasattr(os, "pidfd_open") else -1
        self._vigil = SpinningPoller(descriptor for descriptor in (self._reader, self._output, self._pidfd) if descriptor >= 0)
        self._descriptors = [d for d in (self._writer, self._reader, self._output, self._pidfd) if d >= 0]
        self._answer_event = [(self._reader, select.POLLIN)]
        self._received, self._output_size = b"", 0

    def request(self, line: bytes, deadline: float) -> bytes:
        """Send a command and wait for its answer, for at most `deadline` s. Raises Lost, also when the worker has died."""
        try:
            write_line(self._writer, line)
            if self._vigil.wait(_SHORT_WAIT) == self._answer_event:
                data = os.read(self._reader, READ_SIZE)
                if data == STEP_DONE and not self._received:
                    return STEP_DONE
                self._received += data
            with suspending_deadline():
                return self._wait_for_answer(deadline)
        except BrokenPipeError:
            self._raise_lost()

    def _wait_for_answer(self, deadline: float) -> bytes:
        """The deadline holds for each call into the FMU that the worker's journal tells of."""
        seen, since = self._progress(), time.monotonic()
        while True:
            if (answer := self._take_answer()) is not None:
                return answer
            if (now := self._progress()) != seen:
                seen, since = now, time.monotonic()
            elif time.monotonic() - since > deadline:
                raise WorkerLost(f"did not return within {deadline:g} s")
            self._receive({descriptor for descriptor, _ in self._vigil.wait(min(POLL_INTERVAL, deadline) * 1000)})

    def _progress(self) -> tuple[int, int]:
        return self._journal[CHANGE_COUNT], self._journal[CALL_NUMBER]

    def _take_answer(self) -> bytes | None:
        """The answer, if it has arrived; what the FMU said before is passed on."""
        *lines, self._received = self._received.split(b"\n")
        for place, line in enumerate(lines):
            if not self._forward_log_message(line):
                self._received = b"\n".join([*lines[place + 1 :], self._received])
                return line + b"\n"
        return None

    def _receive(self, ready: set[int]) -> None:
        if self._output in ready:
            self._forward_output()
        if self._reader in ready:
            data = os.read(self._reader, READ_SIZE)
            self._received += data
            if not data:
                self._raise_lost()
            if len(self._received) > _MAX_ANSWER_SIZE:
                raise WorkerLost(f"its process sent more than {_MAX_ANSWER_SIZE} bytes at once")
        elif self._pidfd in ready:
            self._raise_lost()

    def _forward_log_message(self, line: bytes) -> bool:
        """Whether the line is something that the FMU said, which is passed on."""
        if not line.startswith(b'{"log"'):
            return False
        level, text = decode_line(line)["log"]
        component_log.log_message(self._name, int(level), str(text))
        return True

    def _raise_lost(self) -> NoReturn:
        status = self._reap(_EXIT_TIMEOUT)
        raise WorkerLost("its process closed the connection to the importer" if status is None else describe_exit_status(status))

    def _forward_output(self) -> None:
        with suppress(BlockingIOError):
            while data := os.read(self._output, READ_SIZE):
                room = MAX_OUTPUT_SIZE - self._output_size
                self._output_size += len(data)
                if room > 0:
                    sys.stderr.write(data[:room].decode("utf-8", "replace"))
                    sys.stderr.flush()
            self._vigil.unregister(self._output)  # the worker has closed it

    def _reap(self, timeout: float) -> int | None:
        """The status of the process when it has ended within `patience` s. Its children end with it."""
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
        """Let the process end by itself for `patience` s, then kill it; nothing of it is left."""
        if self._pid and self._reap(timeout) is None:
            os.kill(self._pid, signal.SIGKILL)
            self._reap(float("inf"))
        if not self._descriptors:
            return
        with suppress(KeyError):
            self._forward_output()
        if (more := self._output_size - MAX_OUTPUT_SIZE) > 0:
            component_log.log_message(self._name, component_log.WARNING, f"printed {more} bytes more")
        while self._descriptors:
            os.close(self._descriptors.pop())


def _run_worker(serve: Callable[[int, int], None], commands: int, answers: int, printed: int) -> NoReturn:
    code = 70
    _streams = sys.stdout, sys.stderr  # they live on, so that what the importer has not flushed is not written here, too
    try:
        os.dup2(printed, 1)
        os.dup2(printed, 2)
        commands, answers = _duplicate_above_limit(commands), _duplicate_above_limit(answers)
        _close_other_descriptors({0, 1, 2, commands, answers})
        sys.stdout, sys.stderr = (os.fdopen(n, "w", buffering=1, errors="replace", closefd=False) for n in (1, 2))
        serve(commands, answers)
        code = 0
    finally:
        os._exit(code)  # nothing of the importer is ended here, and foreign code has no say


def _duplicate_above_limit(descriptor: int) -> int:
    """A copy that code which closes all descriptors does not find, for it ends where the worker's limit is."""
    import fcntl
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return fcntl.fcntl(
        descriptor, fcntl.F_DUPFD, _FIRST_RESERVED_DESCRIPTOR if soft > 2 * _FIRST_RESERVED_DESCRIPTOR else descriptor
    )


def _close_other_descriptors(kept: set[int]) -> None:
    try:
        opened = {int(path.name) for path in Path("/proc/self/fd").iterdir()}
    except OSError:
        opened = set(range(os.sysconf("SC_OPEN_MAX")))
    for descriptor in opened - kept:
        with suppress(OSError):
            os.close(descriptor)
