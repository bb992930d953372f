"""Commands of `cosim` in forked processes, so that modules are imported only once.

Each command runs in a process of its own, as if it had been started by `python -m cosim`. It is
forked by a process that was forked from this one before this one started threads. Both are needed:
a process with threads must not be forked, and a command must not find what another one has changed.
"""

import gc
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from importlib import import_module
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
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

    `count` threads may call it at the same time. This process must have no threads and must not
    have loaded FMUs. Where processes cannot be forked, or if a forking process has been killed, the
    function starts a new process for each command.
    """
    if not hasattr(os, "fork"):
        yield run_in_new_process
        return
    for module in (*RUN_MODULES, *_COMMAND_MODULES):
        import_module(module)
    gc.freeze()
    with ExitStack() as stack:
        idle = SimpleQueue[Connection]()
        for _ in range(count):
            idle.put(stack.enter_context(_forking_process()))

        def run(words: Sequence[str]) -> CompletedProcess[str]:
            connection = idle.get()
            try:
                connection.send(words)
                return CompletedProcess(words, *connection.recv())
            except (OSError, EOFError):
                return run_in_new_process(words)
            finally:
                idle.put(connection)

        yield run


@contextmanager
def _forking_process() -> Iterator[Connection]:
    """Yield the connection to a process that forks one command at a time."""
    ours, theirs = Pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    process = get_context("fork").Process(target=_serve, args=(theirs, ours, mask))
    process.start()
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    theirs.close()
    try:
        yield ours
    finally:
        ours.close()
        process.join()


def _serve(connection: Connection, other: Connection, mask: SignalMask) -> NoReturn:
    """Run commands until the other end of the connection is closed.

    Interrupts, which commands receive too, are blocked.
    """
    try:
        other.close()
        null = os.open(os.devnull, os.O_RDWR)
        for number in range(3):
            os.dup2(null, number)
        while True:
            connection.send(_run_command(connection.recv(), mask))
    finally:
        os._exit(0)


def _run_command(words: list[str], mask: SignalMask) -> tuple[int, str, str]:
    """Run a command in a forked process.

    Return its exit code as `subprocess` defines it, no output, and its standard error.
    """
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(writer, 2)
        os.close(writer)
        os.close(reader)
        _become_command(words, mask)
    os.close(writer)
    with os.fdopen(reader, errors="replace") as pipe:
        text = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), "", text


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
