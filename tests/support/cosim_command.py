"""`cosim` commands for tests, in processes forked from one that has done all imports (see `fork_server`)."""

from __future__ import annotations

import atexit
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

#: `limit`: time limit of a command (s); `executor`: its kind;
#: `observe`: report what the command changed in its process
CONDITIONS = {"limit": 120, "stdin": os.devnull, "executor": "auto", "observe": False}


class ForkServer:
    """A process with all imports done that forks one command after the other."""

    def __init__(self) -> None:
        command = [sys.executable, Path(__file__).with_name("fork_server.py")]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def close(self) -> None:
        """End the server."""
        self._process.communicate()

    def run(
        self, folder: Path, output: Path, words: tuple[object, ...], environment: Mapping[str, str], **conditions: Any
    ) -> dict[str, Any]:
        """Run a command in `folder` and return its exit code, wall time (s) and the ids of processes that outlived it.

        Args:
            folder: Working directory.
            output: Folder for the files `stdout` and `stderr`.
            words: Arguments of the command.
            environment: Variables that are added to the environment.
            conditions: What differs from CONDITIONS.
        """
        request = {**CONDITIONS, **conditions, "arguments": [*map(str, words)], "folder": str(folder), "output": str(output)}
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(json.dumps({**request, "environment": dict(environment)}), file=self._process.stdin, flush=True)
        return dict(json.loads(self._process.stdout.readline()))


@cache
def shared_server() -> ForkServer:
    """Return the server of this test process, started at its first use."""
    server = ForkServer()
    atexit.register(server.close)
    return server


def run_cosim(
    *words: object, cwd: Path | str | None = None, env: Mapping[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """Run a command like `subprocess.run([python, "-m", "cosim", *words], cwd=cwd, env={**os.environ, **env})`."""
    variables = {name: value for name, value in os.environ.items() if name != "PYTEST_CURRENT_TEST"}
    with tempfile.TemporaryDirectory() as output:
        ended = shared_server().run(Path(cwd or Path.cwd()), Path(output), words, {**variables, **(env or {})})
        texts = [Path(output, name).read_text(encoding="utf-8", errors="replace") for name in ("stdout", "stderr")]
    return subprocess.CompletedProcess(["cosim", *map(str, words)], ended["code"], *texts)
