"""Where jobs are run on this machine: a template process and its lanes, seen from outside."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

from ...core.errors import ComponentError, CosimError, Problem
from .job import Job, Record, StudyContext

#: a run is begun so often when the process that watches over it is killed
MAX_ATTEMPTS = 3
#: imports may take so long, and the end of all runs (s)
_STARTUP_TIMEOUT, _SHUTDOWN_TIMEOUT = 120.0, 5.0
#: so many FMUs are unpacked in advance
_MAX_PRELOADED_FMUS = 100
#: one thread per process: many processes share the machine, and a process with threads cannot be forked
_SINGLE_THREAD_ENVIRONMENT = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
#: a forked process touches all its memory for the first time: with large pages (glibc, Linux) that costs half as much
_LARGE_PAGES_ENVIRONMENT = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}


class WorkerLost(CosimError):
    """The process at the other end is gone."""


class Worker:
    """A process that answers one job after the other."""

    def __init__(self, connection: socket.socket):
        self._connection, self._answers = connection, connection.makefile("rb")

    def request(self, request: dict[str, Any]) -> bytes:
        try:
            self._connection.sendall(json.dumps(request).encode() + b"\n")
            answer = self._answers.readline()
        except OSError:
            answer = b""
        if not answer.endswith(b"\n"):
            raise WorkerLost("a lane ended")
        return answer

    def close(self) -> None:
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()


class _ForkServer:
    """The warm process. One that cannot be warmed up, or has threads then, is started again without."""

    def __init__(self, order: StudyContext):
        if not self._start(order, preload=False):
            self.close()
            if not self._start(order, preload=True):
                raise ComponentError("cosim", "the template process", f"it ended with exit code {self._process.wait()}")

    def _start(self, order: StudyContext, preload: bool) -> bool:
        self._control, other = socket.socketpair()
        with other:
            command = [sys.executable, "-m", "cosim.studies.execution.fork_server", str(other.fileno())]
            self._process = subprocess.Popen(  # noqa: S603
                command,
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**_LARGE_PAGES_ENVIRONMENT, **os.environ, **_SINGLE_THREAD_ENVIRONMENT},
                start_new_session=True,
            )
        place = {"scenario": str(order.scenario.resolve()), "root": str(order.root), "fmus": order.fmus[:_MAX_PRELOADED_FMUS]}
        request = {**place, "deadline": order.deadline, "cold": preload}
        self._control.settimeout(_STARTUP_TIMEOUT)
        with suppress(OSError):
            self._control.sendall(json.dumps(request).encode())
            return self._control.recv(16) == b"warm"
        return False

    def fork_worker(self) -> Worker:
        """A new lane. Raises OSError when the template is gone."""
        own, other = socket.socketpair()
        with other:
            socket.send_fds(self._control, [b"lane"], [other.fileno()])
        return Worker(own)

    @property
    def pid(self) -> int:
        return self._process.pid

    def close(self) -> None:
        """It ends itself, and its lanes, when nobody can ask any more."""
        self._control.close()
        try:
            self._process.wait(_SHUTDOWN_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class WorkerPool:
    """Runs jobs; several threads may ask at a time, each gets a lane of its own. Killed templates and lanes are replaced."""

    def __init__(self, order: StudyContext):
        self._context, self._lock, self._idle = order, threading.Lock(), list[Worker]()
        self._busy: set[Worker] = set()
        self._fork_server: _ForkServer | None = None
        self._closed = False

    def run(self, job: Job) -> Record:
        """The record of a run. Raises Lost when the shop is closed meanwhile."""
        try:
            return Record.from_json(self._request(job, check=False))
        except WorkerLost as error:
            if self._closed:
                raise
            return Record(job.key, failure=str(error))

    def check(self, job: Job) -> list[Problem]:
        """What keeps a job from being run."""
        return [Problem(message, where) for message, where in json.loads(self._request(job, check=True))]

    def replay(self, job: Job, title: str, page: Path) -> Record:
        """Run a job once more and write its 3-D replay; of a run that fails, what was recorded until then."""
        return Record.from_json(self._request(job, check=False, replay={"title": title, "page": str(page.resolve())}))

    def _request(self, job: Job, check: bool, **more: Any) -> bytes:
        request = {"key": job.key, "settings": job.settings, "check": check, **more}
        for _ in range(MAX_ATTEMPTS):
            lane = self._acquire_worker()
            try:
                answer = lane.request(request)
            except WorkerLost:
                self._busy.discard(lane)
                lane.close()
                continue
            with self._lock:
                self._busy.discard(lane)
                self._idle.append(lane)
            return answer
        raise WorkerLost(f"the process that watches over the run was killed {MAX_ATTEMPTS} times")

    def _acquire_worker(self) -> Worker:
        with self._lock:
            if self._closed:
                raise WorkerLost("the sweep was ended")
            lane = self._idle.pop() if self._idle else self._start_worker()
            self._busy.add(lane)
            return lane

    def _start_worker(self) -> Worker:
        if self._fork_server:
            with suppress(OSError):
                return self._fork_server.fork_worker()
            self._fork_server.close()
        self._fork_server = _ForkServer(self._context)
        return self._fork_server.fork_worker()

    def close(self) -> None:
        """End all runs."""
        self._closed = True
        with self._lock:
            for lane in (*self._idle, *self._busy):
                lane.close()
            if self._fork_server:
                self._fork_server.close()
