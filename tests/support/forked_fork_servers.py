"""Fork servers of studies for tests, forked from a process that has done all imports."""

from __future__ import annotations

import multiprocessing
import os
import socket
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from multiprocessing.reduction import DupFd
from types import SimpleNamespace
from typing import Any

from cosim.api.execution import RUN_MODULES
from cosim.studies.execution import fork_server

_CONTEXT = multiprocessing.get_context("forkserver")
_CONTEXT.set_forkserver_preload([fork_server.__name__, *RUN_MODULES])


class ForkedServer:
    """Fork server with the methods of `subprocess.Popen` that the worker pool calls."""

    def __init__(
        self, command: Sequence[str], pass_fds: Sequence[int], env: Mapping[str, str], **_: Any
    ):
        assert command[1:3] == ["-m", fork_server.__name__]
        self._process = _CONTEXT.Process(target=_serve, args=(DupFd(pass_fds[0]), dict(env)))
        self._process.start()
        self.pid, self.kill = self._process.pid, self._process.kill

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        return self._process.exitcode

    def wait(self, timeout: float | None = None) -> int | None:
        """Wait for the end and return the exit code."""
        self._process.join(timeout)
        if self._process.exitcode is None:
            raise subprocess.TimeoutExpired("fork server", timeout or 0.0)
        return self._process.exitcode


#: takes the place of the module `subprocess` in the module `worker_pool`
SUBPROCESS = SimpleNamespace(
    Popen=ForkedServer, DEVNULL=subprocess.DEVNULL, TimeoutExpired=subprocess.TimeoutExpired
)


def _serve(connection: Any, environment: Mapping[str, str]) -> None:
    os.setsid()
    os.environ.clear()
    os.environ.update(environment)
    tempfile.tempdir = None
    null = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1):
        os.dup2(null, stream)
    fork_server.serve_forks(socket.socket(fileno=connection.detach()))
