"""Runner of jobs on this machine, by a pool of worker processes that a fork server forks."""

from __future__ import annotations

import json
import math
import os
import select
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from ...core.errors import ComponentError, CosimError, Problem
from ...process.process_status import has_ended, is_stopped
from ...process.supervisor import STOP_TIMEOUT
from .job import FORK_REQUEST, READY, Job, Record, StudyContext

if TYPE_CHECKING:
    from .run import ReplayRequest


#: attempts at a run whose worker process is killed
MAX_ATTEMPTS = 3
#: time limits for the start of the fork server and for its end (s)
_STARTUP_TIMEOUT, _SHUTDOWN_TIMEOUT = 120.0, 5.0
#: time between two looks at a process that does not answer (s)
_STOP_CHECK_INTERVAL = 1.0
#: number of FMUs unpacked in advance
_MAX_PRELOADED_FMUS = 100
#: one thread per process: many processes share the machine, and a process with threads cannot be
#: forked safely
_SINGLE_THREAD_ENVIRONMENT = dict.fromkeys(
    ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)
#: large pages (glibc on Linux) halve the cost of page faults in a forked process
_LARGE_PAGES_ENVIRONMENT = {"GLIBC_TUNABLES": "glibc.malloc.hugetlb=1"}


class WorkerLostError(CosimError):
    """A worker process that ended or was killed."""


class Worker:
    """Connection to a worker process, which handles one job at a time.

    The first line that the process sends is its id.
    """

    def __init__(self, connection: socket.socket, fork_server: int):
        self._connection, self._fork_server = connection, fork_server
        self._poll = select.poll()
        self._poll.register(connection, select.POLLIN)
        self._process: int | None = None

    def request(self, request: dict[str, Any]) -> bytes:
        """Send a request and return the answer, a line of JSON.

        Raises:
            WorkerLostError: if the process ends before it has answered, or is killed because it was
                stopped from outside.
        """
        try:
            if self._process is None:
                self._process = int(self._read_line())
            self._connection.sendall(json.dumps(request).encode() + b"\n")
            return self._read_line()
        except (OSError, ValueError):
            raise WorkerLostError("a worker process ended") from None

    def _read_line(self) -> bytes:
        """Return the next line.

        Kill the worker, or the fork server before there is one, if it is stopped for too long.

        Raises:
            ConnectionError: if the process has ended.
        """
        line, stopped_since = b"", math.inf
        while not line.endswith(b"\n"):
            if self._poll.poll(_STOP_CHECK_INTERVAL * 1000):
                if not (data := self._connection.recv(1 << 16)):
                    raise ConnectionError
                line += data
                continue
            process = self._process or self._fork_server
            if has_ended(
                process
            ):  # another process, which it has left behind, keeps the connection open
                raise ConnectionError
            stopped_since = (
                min(stopped_since, time.monotonic()) if is_stopped(process) else math.inf
            )
            if time.monotonic() - stopped_since > STOP_TIMEOUT:
                os.kill(process, signal.SIGKILL)  # closes the connection
                stopped_since = math.inf
        return line

    def close(self) -> None:
        """Close the connection; the worker process then ends."""
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()


class _ForkServer:
    """Process that forks workers.

    If preloading fails or starts threads in it, it is restarted without preloading.
    """

    def __init__(self, context: StudyContext):
        if not self._start(context, preload=True):
            self.close()
            if not self._start(context, preload=False):
                raise ComponentError(
                    "cosim", "the fork server", f"it ended with exit code {self._process.wait()}"
                )

    def _start(self, context: StudyContext, preload: bool) -> bool:
        self._control, other = socket.socketpair()
        with other:
            command = [
                sys.executable,
                "-m",
                "cosim.studies.execution.fork_server",
                str(other.fileno()),
            ]
            self._process = subprocess.Popen(  # noqa: S603
                command,
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                env={**_LARGE_PAGES_ENVIRONMENT, **os.environ, **_SINGLE_THREAD_ENVIRONMENT},
                start_new_session=True,
            )
        request = {
            "scenario": str(context.scenario.resolve()),
            "root": str(context.root),
            "fmus": context.fmus[:_MAX_PRELOADED_FMUS],
            "deadline": context.deadline,
            "preload": preload,
        }
        with suppress(OSError):
            self._control.sendall(json.dumps(request).encode())
            return self._wait_until_started() and self._control.recv(16) == READY
        return False

    def _wait_until_started(self) -> bool:
        """Wait for an answer of the process. Return False if it ends, or takes too long."""
        deadline = time.monotonic() + _STARTUP_TIMEOUT
        while time.monotonic() < deadline and self._process.poll() is None:
            if select.select([self._control], [], [], _STOP_CHECK_INTERVAL)[0]:
                return True
        return False

    def fork_worker(self) -> Worker:
        """Fork a worker.

        Raises:
            OSError: if the fork server has ended.
        """
        connection, other = socket.socketpair()
        with other:
            socket.send_fds(self._control, [FORK_REQUEST], [other.fileno()])
        return Worker(connection, self.pid)

    @property
    def pid(self) -> int:
        """Process id of the fork server."""
        return self._process.pid

    def close(self) -> None:
        """Close the connection; the fork server then ends its workers and itself."""
        self._control.close()
        try:
            self._process.wait(_SHUTDOWN_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


class WorkerPool:
    """Pool of worker processes for the runs of a study.

    Several threads may call it at the same time; each of them gets a separate worker. Killed
    workers and a killed fork server are replaced.
    """

    def __init__(self, context: StudyContext):
        self._context, self._lock, self._idle = context, threading.Lock(), list[Worker]()
        self._busy: set[Worker] = set()
        self._fork_server: _ForkServer | None = None
        self._closed = False

    def run(self, job: Job) -> Record:
        """Run a job and return its record.

        Raises:
            WorkerLostError: if the pool is closed during the run.
        """
        try:
            return Record.from_json(self._request(job, check=False))
        except WorkerLostError as error:
            if self._closed:
                raise
            return Record(job.key, failure=str(error))

    def check(self, job: Job) -> list[Problem]:
        """Return the problems for which a job cannot be run."""
        return [
            Problem(message, where) for message, where in json.loads(self._request(job, check=True))
        ]

    def replay(self, job: Job, request: ReplayRequest) -> Record:
        """Run a job again and write its 3-D replay; after a failure, the replay ends there."""
        return Record.from_json(self._request(job, check=False, replay=request._asdict()))

    def _request(self, job: Job, check: bool, **more: Any) -> bytes:
        request = {"key": job.key, "settings": job.settings, "check": check, **more}
        for _ in range(MAX_ATTEMPTS):
            with self._lock:
                if self._closed:
                    raise WorkerLostError("the worker pool is closed")
                worker = self._idle.pop() if self._idle else self._start_worker()
                self._busy.add(worker)
            try:
                answer = worker.request(request)
            except WorkerLostError:
                self._busy.discard(worker)
                worker.close()
                continue
            with self._lock:
                self._busy.discard(worker)
                self._idle.append(worker)
            return answer
        raise WorkerLostError(f"the worker process of the run was killed {MAX_ATTEMPTS} times")

    def _start_worker(self) -> Worker:
        if self._fork_server:
            with suppress(OSError):
                return self._fork_server.fork_worker()
            self._fork_server.close()
        self._fork_server = _ForkServer(self._context)
        return self._fork_server.fork_worker()

    def close(self) -> None:
        """End all runs and their processes."""
        self._closed = True
        with self._lock:
            for worker in (*self._idle, *self._busy):
                worker.close()
            if self._fork_server:
                self._fork_server.close()


class LocalRunner:
    """Runner of `workers` jobs at a time on this machine; leaving its context ends all runs."""

    def __init__(self, context: StudyContext, workers: int):
        self.worker_pool, self._workers = WorkerPool(context), workers

    def __enter__(self) -> LocalRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self.worker_pool.close()

    def check(self, job: Job) -> list[Problem]:
        """Return the problems for which a job cannot be run."""
        return self.worker_pool.check(job)

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Run the jobs and yield their records in the order in which the runs end.

        Only a few jobs are taken from the iterable in advance. Each thread waits for a worker
        process.
        """
        pending: set[Future[Record]] = set()
        pool = ThreadPoolExecutor(self._workers)
        try:
            for job in jobs:
                pending.add(pool.submit(self.worker_pool.run, job))
                if len(pending) >= 2 * self._workers:
                    done, pending = wait(pending, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in done)
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        except BaseException:
            self.worker_pool.close()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
