"""Runs commands on misbehaving FMUs and looks at what came of it and what was left behind."""

from __future__ import annotations

import csv
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from cosim_command import ForkServer
from fault_fmu import scenario


@dataclass(frozen=True)
class CommandResult:
    """Exit code and wall time (s) of a command, ids of processes that outlived it, and what stands
    in its folder.
    """

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
        paths = [self.folder / "result.csv", self.folder / "out" / "result.csv"]
        path = next(filter(Path.is_file, paths), Path(os.devnull))
        with path.open() as file:
            table = list(csv.reader(file))
        return [dict(zip(table[0], map(float, line), strict=True)) for line in table[1:]]

    @cached_property
    def changes(self) -> list[str]:
        """Changes of the command to its own process (folder, locale, signals ...); an entry when it
        never came to its end.
        """
        report = self.folder / "changes"
        return report.read_text().splitlines() if report.exists() else ["the process ended early"]

    @cached_property
    def temporary_files(self) -> list[str]:
        """Names left in the folder for temporary files."""
        return sorted(path.name for path in (self.folder / "tmp").iterdir())


class CommandRunner:
    """Runs commands on misbehaving FMUs in forked processes."""

    def __init__(self) -> None:
        self._server = ForkServer()

    def close(self) -> None:
        self._server.close()

    def cosim(
        self,
        folder: Path,
        *arguments: object,
        environment: Mapping[str, str] | None = None,
        **conditions: Any,
    ) -> CommandResult:
        """Run a command in `folder`, with temporary files in folder/tmp; `conditions`: see
        `cosim_command.CONDITIONS`.
        """
        (folder / "tmp").mkdir(exist_ok=True)
        environment = {"TMPDIR": str(folder / "tmp"), **(environment or {})}
        conditions = {"limit": 60, "observe": True, **conditions}
        return CommandResult(
            folder, **self._server.run(folder, folder, arguments, environment, **conditions)
        )

    def run(
        self, folder: Path, fmu: Path, deadlines: dict[str, float] | None = None, **conditions: Any
    ) -> CommandResult:
        """`cosim run` of a scenario around the FMU; results in folder/out."""
        words = ("run", scenario(folder, fmu, deadlines), "--output-dir", "out", "--no-report")
        return self.cosim(folder, *words, **conditions)

    def simulate(self, folder: Path, fmu: Path, *words: str, **conditions: Any) -> CommandResult:
        """`cosim simulate` of the FMU alone; results in folder/result.csv."""
        return self.cosim(
            folder, "simulate", fmu, "--output-file", "result.csv", *words, **conditions
        )
