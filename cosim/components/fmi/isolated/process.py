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
from ....process.journal import CALL, CHANGES, Journal, waiting
from ....process.supervisor import LARGEST_OUTPUT, LOOK, ending
from .pipes import DONE, PIECE, Vigil, decode, write

#: so long (ms) a wait is a usual one, which the supervisor of the run looks after, too
_USUAL_WAIT = 20
#: a worker that closed its pipes has this long to end by itself (s)
_LAST_MOMENT = 0.5
#: descriptors from here on are above the limit of a worker
_MANY = 256
#: bytes of an answer at most
_LARGEST_ANSWER = 1 << 26


class Lost(Exception):
    """The worker is no longer there, or must not be; says why."""


class Process:
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
            _be_the_worker(serve, commands, answers, printed)
        for descriptor in (commands, answers, printed):
            os.close(descriptor)
        os.set_blocking(self._output, False)
        self._died = os.pidfd_open(self._pid) if hasattr(os, "pidfd_open") else -1
        self._vigil = Vigil(descriptor for descriptor in (self._reader, self._output, self._died) if descriptor >= 0)
        self._opened = [d for d in (self._writer, self._reader, self._output, self._died) if d >= 0]
        self._usual = [(self._reader, select.POLLIN)]
        self._rest, self._printed = b"", 0

    def request(self, line: bytes, deadline: float) -> bytes:
        """Send a command and wait for its answer, for at most `deadline` s. Raises Lost, also when the worker has died."""
        try:
            write(self._writer, line)
            if self._vigil.wait(_USUAL_WAIT) == self._usual:
                data = os.read(self._reader, PIECE)
                if data == DONE and not self._rest:
                    return DONE
                self._rest += data
            with waiting():
                return self._answer(deadline)
        except BrokenPipeError:
            self._lost()

    def _answer(self, deadline: float) -> bytes:
        """The deadline holds for each call into the FMU that the worker's journal tells of."""
        seen, since = self._progress(), time.monotonic()
        while True:
            if (answer := self._taken()) is not None:
                return answer
            if (now := self._progress()) != seen:
                seen, since = now, time.monotonic()
            elif time.monotonic() - since > deadline:
                raise Lost(f"did not return within {deadline:g} s")
            self._receive({descriptor for descriptor, _ in self._vigil.wait(min(LOOK, deadline) * 1000)})

    def _progress(self) -> tuple[int, int]:
        return self._journal[CHANGES], self._journal[CALL]

    def _taken(self) -> bytes | None:
        """The answer, if it has arrived; what the FMU said before is passed on."""
        *lines, self._rest = self._rest.split(b"\n")
        for place, line in enumerate(lines):
            if not self._is_message(line):
                self._rest = b"\n".join([*lines[place + 1 :], self._rest])
                return line + b"\n"
        return None

    def _receive(self, ready: set[int]) -> None:
        if self._output in ready:
            self._pass_on()
        if self._reader in ready:
            data = os.read(self._reader, PIECE)
            self._rest += data
            if not data:
                self._lost()
            if len(self._rest) > _LARGEST_ANSWER:
                raise Lost(f"its process sent more than {_LARGEST_ANSWER} bytes at once")
        elif self._died in ready:
            self._lost()

    def _is_message(self, line: bytes) -> bool:
        """Whether the line is something that the FMU said, which is passed on."""
        if not line.startswith(b'{"log"'):
            return False
        level, text = decode(line)["log"]
        component_log.message(self._name, int(level), str(text))
        return True

    def _lost(self) -> NoReturn:
        status = self._reaped(_LAST_MOMENT)
        raise Lost("its process closed the connection to the importer" if status is None else ending(status))

    def _pass_on(self) -> None:
        with suppress(BlockingIOError):
            while data := os.read(self._output, PIECE):
                room = LARGEST_OUTPUT - self._printed
                self._printed += len(data)
                if room > 0:
                    sys.stderr.write(data[:room].decode("utf-8", "replace"))
                    sys.stderr.flush()
            self._vigil.forget(self._output)  # the worker has closed it

    def _reaped(self, patience: float) -> int | None:
        """The status of the process when it has ended within `patience` s. Its children end with it."""
        end = time.monotonic() + patience
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

    def end(self, patience: float = 0.0) -> None:
        """Let the process end by itself for `patience` s, then kill it; nothing of it is left."""
        if self._pid and self._reaped(patience) is None:
            os.kill(self._pid, signal.SIGKILL)
            self._reaped(float("inf"))
        if not self._opened:
            return
        with suppress(KeyError):
            self._pass_on()
        if (more := self._printed - LARGEST_OUTPUT) > 0:
            component_log.message(self._name, component_log.WARNING, f"printed {more} bytes more")
        while self._opened:
            os.close(self._opened.pop())


def _be_the_worker(serve: Callable[[int, int], None], commands: int, answers: int, printed: int) -> NoReturn:
    code = 70
    _streams = sys.stdout, sys.stderr  # they live on, so that what the importer has not flushed is not written here, too
    try:
        os.dup2(printed, 1)
        os.dup2(printed, 2)
        commands, answers = _out_of_reach(commands), _out_of_reach(answers)
        _close_all_but({0, 1, 2, commands, answers})
        sys.stdout, sys.stderr = (os.fdopen(n, "w", buffering=1, errors="replace", closefd=False) for n in (1, 2))
        serve(commands, answers)
        code = 0
    finally:
        os._exit(code)  # nothing of the importer is ended here, and foreign code has no say


def _out_of_reach(descriptor: int) -> int:
    """A copy that code which closes all descriptors does not find, for it ends where the worker's limit is."""
    import fcntl
    import resource

    soft, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
    return fcntl.fcntl(descriptor, fcntl.F_DUPFD, _MANY if soft > 2 * _MANY else descriptor)


def _close_all_but(kept: set[int]) -> None:
    try:
        opened = {int(path.name) for path in Path("/proc/self/fd").iterdir()}
    except OSError:
        opened = set(range(os.sysconf("SC_OPEN_MAX")))
    for descriptor in opened - kept:
        with suppress(OSError):
            os.close(descriptor)
