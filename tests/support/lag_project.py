"""Projects with sweeps over a first-order lag FMU with injectable faults."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from cosim_command import StartedCommand
from fault_fmu import FaultFmus

from cosim.cli import CommandLine, cli, run_guarded

KPIS = [{"name": "end", "python": "cosim.kpis:final", "arguments": {"signal": "lag.y"}}]
SEGV_ORDER = "DoStep 6 segv"


@dataclass(frozen=True)
class CommandResult:
    """Exit code and output of a command."""

    code: int
    out: str
    err: str


@dataclass
class LagProject:
    """Folder with a scenario around the lag FMU; runs commands in this folder."""

    folder: Path
    last_result: CommandResult | None = None

    @classmethod
    def create(cls, folder: Path, library: Path, **more: Any) -> LagProject:
        """Create the FMU and its scenario in `folder`; `more` replaces keys of the scenario."""
        FaultFmus({2: library}, folder)(2)
        content = {
            "name": "lag",
            "stop_time": 0.1,
            "step_size": 0.01,
            "components": {"lag": {"fmu": "lag.fmu"}},
        }
        content |= {"record": {"signals": ["lag.y"]}, "kpis": KPIS, **more}
        (folder / "lag.json").write_text(json.dumps(content))
        return cls(folder)

    def write(self, name: str = "sweep", **content: Any) -> Path:
        """Write a sweep or tuning file of the scenario and return its path."""
        file = self.folder / f"{name}.json"
        file.write_text(json.dumps({"name": name, "scenario": "lag.json", **content}))
        return file

    def run_command(self, *words: object) -> CommandResult:
        """Run a command in this process, where all modules are imported already."""
        out, err = StringIO(), StringIO()
        with chdir(self.folder), redirect_stdout(out), redirect_stderr(err):
            code = run_guarded(
                lambda: cli.main([*map(str, words)], standalone_mode=False), CommandLine()
            )
        self.last_result = CommandResult(code, out.getvalue(), err.getvalue())
        return self.last_result

    def start_command(self, *words: object) -> StartedCommand:
        """Start a command in a separate process."""
        return StartedCommand(*words, cwd=self.folder, env=os.environ)

    def table(self, folder: str = "runs/sweep", file: str = "table.csv") -> list[dict[str, str]]:
        """Read a CSV file of the results as one dictionary per row."""
        with (self.folder / folder / file).open(newline="") as text:
            return list(csv.DictReader(text))

    def records(self, folder: str = "runs/sweep") -> list[dict[str, Any]]:
        """Read the finished runs of a study; empty before the first one."""
        file = self.folder / folder / "journal.jsonl"
        lines = file.read_bytes().split(b"\n")[:-1] if file.exists() else []
        return [json.loads(line) for line in lines]


MakeLagProject = Callable[..., LagProject]


def descendants(process: int) -> list[int]:
    """Return the ids of all descendants of a process, parents before children."""
    found = []
    for path in Path(f"/proc/{process}/task").glob("*/children"):
        for child in map(int, path.read_text().split()):
            found += [child, *descendants(child)]
    return found


def is_alive(process: int) -> bool:
    """Return whether a process exists and is not a zombie."""
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
