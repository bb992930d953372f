"""Commands as a user starts them, and what they leave behind."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cosim_command import StartedCommand

TICKER = Path(__file__).parent / "slow_counter.py"


def wait_until(condition: Callable[[], Any], limit: float = 30.0) -> Any:
    """The first true value of a condition, or the last false one."""
    end = time.monotonic() + limit
    while not (value := condition()) and time.monotonic() < end:
        time.sleep(0.005)
    return value


class CommandFolder:
    """A folder to run commands in; temporary files go to its folder tmp, results to out."""

    def __init__(self, folder: Path):
        self.folder, self.tmp, self.out = folder, folder / "tmp", folder / "out"
        self.tmp.mkdir(parents=True)
        self._sessions: set[int] = set()

    def scenario(self, stop: float = 1000.0, **more: Any) -> Path:
        """A scenario with a ticker; its keys are replaced by `more`, those of the ticker's
        arguments by `arguments`.
        """
        arguments = more.pop("arguments", {})
        content = {
            "name": "robust",
            "stop_time": stop,
            "step_size": 0.01,
            "components": {"ticker": {"python": f"{TICKER}:SlowCounter", "arguments": arguments}},
            **more,
        }
        path = self.folder / "robust.json"
        path.write_text(json.dumps(content))
        return path

    def start(
        self, *arguments: object, environment: dict[str, str] | None = None, **more: Any
    ) -> subprocess.Popen[str] | StartedCommand:
        """Start a command: with an environment or options of `subprocess.Popen` as a program, else
        in a forked process.
        """
        variables = {
            **os.environ,
            "TMPDIR": str(self.tmp),
            "WORKPLACE": str(self.folder),
            **(environment or {}),
        }
        if environment is None and not more:
            process = StartedCommand(*arguments, cwd=self.folder, env=variables)
            self._sessions.add(process.pid)
            return process
        command = [sys.executable, "-m", "cosim", *map(str, arguments)]
        usual = {
            "cwd": self.folder,
            "stdout": subprocess.PIPE,
            "stderr": subprocess.PIPE,
            "text": True,
        }
        return subprocess.Popen(command, env=variables, **{**usual, **more})

    def run(self, *arguments: object, **more: Any) -> subprocess.CompletedProcess[str]:
        process = self.start(*arguments, **more)
        out, err = process.communicate(timeout=100)
        return subprocess.CompletedProcess(process.args, process.returncode, out, err)

    def wait_for_file(self, name: str) -> bool:
        """Wait for a file that a component makes."""
        return bool(wait_until((self.folder / name).exists))

    def processes(self) -> list[int]:
        """Processes that were started here and are still there.

        Programs have the mark in their environment; processes that were only forked share a session
        or the working directory.
        """
        mark = f"WORKPLACE={self.folder}\0".encode()
        entries = [entry for entry in Path("/proc").iterdir() if entry.name.isdigit()]
        return [
            int(entry.name)
            for entry in entries
            if mark in _environment(entry) or self._is_forked_here(entry)
        ]

    def _is_forked_here(self, process: Path) -> bool:
        try:
            state, *_, session = (process / "stat").read_text().rpartition(")")[2].split()[:4]
            here = (process / "cwd").readlink()
        except OSError:
            return False
        return state != "Z" and (int(session) in self._sessions or here == self.folder)

    def leftovers(self) -> list[str]:
        """Everything that should not be there when a command has ended: processes, temporary files,
        hidden files.
        """
        wait_until(lambda: not self.processes(), 3.0)
        hidden = [path.name for path in self.folder.rglob(".*")]
        return [*map(str, self.processes()), *(path.name for path in self.tmp.iterdir()), *hidden]


def _environment(process: Path) -> bytes:
    try:
        return (process / "environ").read_bytes()
    except OSError:
        return b""


def child_processes(process: int) -> list[int]:
    try:
        return [
            int(word)
            for word in Path(f"/proc/{process}/task/{process}/children").read_text().split()
        ]
    except OSError:
        return []
