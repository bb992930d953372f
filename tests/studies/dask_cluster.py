"""Dask cluster on loopback: a scheduler and its workers, each a process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

#: time limit for the start of a process on a busy machine (s)
START_TIMEOUT = 60.0


class DaskCluster:
    """Processes of a cluster, with their files in a folder."""

    def __init__(self, folder: Path, workers: int):
        self.folder = folder
        self._file = folder / "scheduler.json"
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", self._file
        )
        self.address: str = self._wait_for_file()["address"]
        self.workers = [self.start_worker() for _ in range(workers)]

    def start_worker(self, **environment: str) -> subprocess.Popen[bytes]:
        """Start another worker with one thread and its own folder for received files."""
        words = (
            self.address,
            "--no-nanny",
            "--nthreads",
            1,
            "--host",
            "127.0.0.1",
            "--local-directory",
            self.folder / "scratch",
        )
        return self._start("worker", *words, **environment)

    def _start(self, kind: str, *words: object, **environment: str) -> subprocess.Popen[bytes]:
        command = [
            sys.executable,
            "-m",
            f"distributed.cli.dask_{kind}",
            "--no-dashboard",
            *map(str, words),
        ]
        with (self.folder / "log").open("ab") as log:
            variables = {**os.environ, **environment}
            return subprocess.Popen(
                command,
                cwd=self.folder,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env=variables,
            )

    def _wait_for_file(self) -> dict[str, Any]:
        end = time.monotonic() + START_TIMEOUT
        while time.monotonic() < end:
            if self._file.exists() and (text := self._file.read_text()).rstrip().endswith("}"):
                return dict(json.loads(text))
            time.sleep(0.05)
        raise TimeoutError((self.folder / "log").read_text())

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()


@contextmanager
def running_cluster(folder: Path, workers: int = 2) -> Iterator[DaskCluster]:
    made = DaskCluster(folder, workers)
    try:
        yield made
    finally:
        made.close()
