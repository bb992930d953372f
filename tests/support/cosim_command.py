"""`cosim` commands for tests, in processes forked from one that has done all imports (see
`fork_server`).
"""

from __future__ import annotations

import atexit
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

#: `limit`: time limit of a command (s); `executor`: its kind;
#: `observe`: report what the command changed in its process; `wait`: answer when the command has
#: ended; `closed`: numbers of closed standard streams
CONDITIONS = {
    "limit": 120,
    "stdin": os.devnull,
    "executor": "auto",
    "observe": False,
    "wait": True,
    "closed": (),
}


class ForkServer:
    """A process with all imports done that forks one command after the other."""

    def __init__(self, *options: str) -> None:
        command = [sys.executable, Path(__file__).with_name("fork_server.py"), *options]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def close(self) -> None:
        """End the server."""
        self._process.communicate()

    def run(
        self,
        folder: Path,
        output: Path,
        words: tuple[object, ...],
        environment: Mapping[str, str],
        **conditions: Any,
    ) -> dict[str, Any]:
        """Run a command in `folder` and return its exit code, wall time (s) and the ids of
        processes that outlived it.

        Args:
            folder: Working directory.
            output: Folder for the files `stdout` and `stderr`.
            words: Arguments of the command.
            environment: Variables that are added to the environment.
            conditions: What differs from CONDITIONS.
        """
        return dict(self._ask(self._request(folder, output, words, environment, **conditions)))

    def start(
        self, folder: Path, output: Path, words: tuple[object, ...], environment: Mapping[str, str]
    ) -> int:
        """Start a command like `run` and return its process id."""
        return int(self._ask(self._request(folder, output, words, environment, wait=False)))

    def poll(self, process: int) -> int | None:
        """Exit code of a started command, None while it runs; may be called until it has ended."""
        code = self._ask({"poll": process})
        return None if code is None else int(code)

    @staticmethod
    def _request(
        folder: Path,
        output: Path,
        words: tuple[object, ...],
        environment: Mapping[str, str],
        **conditions: Any,
    ) -> dict[str, Any]:
        places = {"folder": str(folder), "output": str(output), "environment": dict(environment)}
        return {**CONDITIONS, **conditions, "arguments": [*map(str, words)], **places}

    def _ask(self, request: dict[str, Any]) -> Any:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(json.dumps(request), file=self._process.stdin, flush=True)
        return json.loads(self._process.stdout.readline())


@cache
def shared_server() -> ForkServer:
    """Return the server of this test process, started at its first use."""
    server = ForkServer()
    atexit.register(server.close)
    return server


@cache
def starting_server() -> ForkServer:
    """Return the server of this test process for commands that go on; orphans of those belong to no
    process of the tests.
    """
    server = ForkServer("--without-orphans")
    atexit.register(server.close)
    return server


class StartedCommand:
    """A command with the methods of `subprocess.Popen` that tests call, in a forked process that
    leads its session.
    """

    def __init__(self, *words: object, cwd: Path, env: Mapping[str, str]):
        self.args: list[str] = ["cosim", *map(str, words)]
        self.returncode: int | None = None
        self._output = tempfile.TemporaryDirectory()
        self.pid = starting_server().start(cwd, Path(self._output.name), words, env)

    def poll(self) -> int | None:
        """Return the exit code, None while it runs."""
        if self.returncode is None:
            self.returncode = starting_server().poll(self.pid)
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal unless the command has ended."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Kill the process of the command."""
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float = 120.0) -> int:
        """Wait for the end and return the exit code."""
        end = time.monotonic() + timeout
        while (code := self.poll()) is None:
            if time.monotonic() > end:
                raise subprocess.TimeoutExpired(self.args, timeout)
            time.sleep(0.005)
        return code

    def communicate(self, timeout: float = 120.0) -> tuple[str, str]:
        """Wait for the end and return what was written to both streams."""
        self.wait(timeout)
        return self._text("stdout"), self._text("stderr")

    def first_line(self) -> str:
        """Wait for the first line of the output, or for the end of the command, and return the
        line.
        """
        while "\n" not in self._text("stdout") and self.poll() is None:
            time.sleep(0.005)
        return self._text("stdout").partition("\n")[0]

    def _text(self, name: str) -> str:
        file = Path(self._output.name, name)
        return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""


def run_cosim(
    *words: object, cwd: Path | str | None = None, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command like `subprocess.run([python, "-m", "cosim", *words], cwd=cwd,
    env={**os.environ, **env})`.
    """
    variables = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    with tempfile.TemporaryDirectory() as output:
        ended = shared_server().run(
            Path(cwd or Path.cwd()), Path(output), words, {**variables, **(env or {})}
        )
        texts = [
            Path(output, name).read_text(encoding="utf-8", errors="replace")
            for name in ("stdout", "stderr")
        ]
    return subprocess.CompletedProcess(["cosim", *map(str, words)], ended["code"], *texts)
