"""Runs commands on misbehaving FMUs and looks at what came of it and what was left behind."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fault_fmu import HERE, scenario

#: `limit`: time limit of a command (s); `sandbox`: settings of `cosim.process.sandbox`; `executor`: its kind
CONDITIONS = {"limit": 60, "stdin": os.devnull, "sandbox": None, "executor": "auto"}


@dataclass(frozen=True)
class CommandResult:
    """Exit code and wall time (s) of a command, ids of processes that outlived it, and what stands in its folder."""

    folder: Path
    code: int
    seconds: float
    processes: list[int]

    @cached_property
    def out(self) -> str:
        return (self.folder / "stdout").read_text(errors="replace")

    @cached_property
    def err(self) -> str:
        return (self.folder / "stderr").read_text(errors="replace")

    @cached_property
    def rows(self) -> list[dict[str, float]]:
        """Rows of the result file; none where there is no file."""
        files = [path for name in ("result.csv", "out/result.csv") if (path := self.folder / name).is_file()]
        with (files[0] if files else Path(os.devnull)).open() as file:
            return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]

    @cached_property
    def changes(self) -> list[str]:
        """What the command changed in its own process (folder, locale, signals ...); an entry when it never came to its end."""
        report = self.folder / "changes"
        return report.read_text().splitlines() if report.exists() else ["the process ended early"]

    @cached_property
    def temporary_files(self) -> list[str]:
        """What was left in the folder for temporary files."""
        return sorted(path.name for path in (self.folder / "tmp").iterdir())


class CommandRunner:
    """Runs commands in processes forked from one that has imported everything; or anew, by `python -m cosim`."""

    def __init__(self) -> None:
        command = [sys.executable, HERE / "fork_server.py"]
        self._server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def close(self) -> None:
        self._server.communicate()

    def cosim(self, folder: Path, *arguments: object, **conditions: Any) -> CommandResult:
        """A command in `folder`, with temporary files in folder/tmp, under conditions other than CONDITIONS."""
        (folder / "tmp").mkdir(exist_ok=True)
        request = {**CONDITIONS, **conditions, "arguments": [*map(str, arguments)], "folder": str(folder)}
        assert self._server.stdin is not None and self._server.stdout is not None
        print(json.dumps(request), file=self._server.stdin, flush=True)
        return CommandResult(folder, **json.loads(self._server.stdout.readline()))

    def run(self, folder: Path, fmu: Path, deadlines: dict[str, float] | None = None, **conditions: Any) -> CommandResult:
        """`cosim run` of a scenario around the FMU; results in folder/out."""
        words = ("run", scenario(folder, fmu, deadlines), "--output-dir", "out", "--no-report")
        return self.cosim(folder, *words, **conditions)

    def simulate(self, folder: Path, fmu: Path, *words: str, **conditions: Any) -> CommandResult:
        """`cosim simulate` of the FMU alone; results in folder/result.csv."""
        return self.cosim(folder, "simulate", fmu, "--output-file", "result.csv", *words, **conditions)
