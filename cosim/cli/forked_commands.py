"""Commands of `cosim` in forked processes, so that modules are imported only once.

Each command runs in a process of its own, as if it had been started by `python -m cosim`. It is
forked by a process that was forked from this one before this one started threads.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import socket
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from pathlib import Path
from queue import SimpleQueue
from subprocess import CompletedProcess
from typing import NoReturn

from ..api.execution import RUN_MODULES
from ..studies.regression import CommandRunner, run_in_new_process
from . import main

#: modules that `cosim run` imports lazily, in addition to those of every run
_COMMAND_MODULES = (
    "cosim.cli.commands.run",
    "cosim.cli.messages",
    "cosim.process.supervisor",
    "cosim.report.tables",
    "email.parser",
    "encodings.ascii",
    "encodings.cp437",
    "encodings.utf_8_sig",
    "numpy.ma",
)

#: return type of `signal.pthread_sigmask`
SignalMask = set[int | signal.Signals]


@contextmanager
def forked_commands(count: int) -> Iterator[CommandRunner]:
    """Yield a function that runs a `cosim` command in a separate process.

    `count` threads may call it at the same time.

    This process must have no threads and must not have loaded FMUs. Where processes cannot be
    forked, the function starts a new process for each command.
    """
    if not hasattr(os, "fork"):
        yield run_in_new_process
        return
    for module in (*RUN_MODULES, *_COMMAND_MODULES):
        import_module(module)
    gc.freeze()
    with ExitStack() as stack:
        idle = SimpleQueue[_ForkingProcess]()
        for _ in range(count):
            idle.put(process := _ForkingProcess())
            stack.callback(process.close)

        def run(words: Sequence[str]) -> CompletedProcess[str]:
            process = idle.get()
            try:
                return process.run(words)
            finally:
                idle.put(process)

        yield run


class _ForkingProcess:
    """Process that forks one command at a time."""

    def __init__(self) -> None:
        self._connection, other = socket.socketpair()
        sys.stdout.flush()
        sys.stderr.flush()
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        self._process = os.fork()
        if self._process == 0:
            self._connection.close()
            _serve(other, mask)
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        other.close()
        self._stream = self._connection.makefile("rw", encoding="utf-8")

    def run(self, words: Sequence[str]) -> CompletedProcess[str]:
        """Run a command; in a new process if the forking process has ended."""
        with suppress(ConnectionError):
            print(json.dumps(words), file=self._stream, flush=True)
            if answer := self._stream.readline():
                code, errors = json.loads(answer)
                return CompletedProcess(words, code, "", errors)
        return run_in_new_process(words)

    def close(self) -> None:
        """End the process."""
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        with suppress(ChildProcessError):
            os.waitpid(self._process, 0)
        with suppress(OSError):
            self._stream.close()
        self._connection.close()


def _serve(connection: socket.socket, mask: SignalMask) -> NoReturn:
    """Run commands until the connection is closed.

    Interrupts, which commands receive too, are blocked.
    """
    try:
        _redirect_streams((0, 1, 2))
        with connection.makefile("rw", encoding="utf-8") as stream:
            for line in stream:
                print(
                    json.dumps(_run_command(json.loads(line), connection, mask)),
                    file=stream,
                    flush=True,
                )
    finally:
        os._exit(0)


def _run_command(words: list[str], connection: socket.socket, mask: SignalMask) -> tuple[int, str]:
    """Run a command in a forked process; return its exit code and its standard error."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(writer, 2)
        os.close(writer)
        os.close(reader)
        connection.detach()
        _become_command(words, mask)
    os.close(writer)
    with os.fdopen(reader, errors="replace") as pipe:
        text = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), text


def _become_command(words: list[str], mask: SignalMask) -> NoReturn:
    """Run a command in this process, which was just forked, and end the process.

    The command finds the state of a new interpreter.
    """
    code: object = 130
    try:
        sys.stdout, sys.stderr = sys.__stdout__, sys.__stderr__
        sys.argv[1:] = words
        if not sys.flags.safe_path:
            sys.path[0] = str(Path.cwd())
        sys.modules["numpy.random"].seed()
        with suppress(KeyboardInterrupt):
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
            main(words)
    except SystemExit as ended:
        code = ended.code
    finally:
        for stream in filter(None, (sys.stdout, sys.stderr)):
            stream.flush()
        os._exit(code if isinstance(code, int) else 70)


def _redirect_streams(numbers: Sequence[int]) -> None:
    """Connect standard streams to the null device."""
    null = os.open(os.devnull, os.O_RDWR)
    for number in numbers:
        os.dup2(null, number)
    os.close(null)
