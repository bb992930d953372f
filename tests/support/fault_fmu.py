"""Builds FMUs that misbehave on order."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zipfile import ZipFile

import fmpy

HERE = Path(__file__).parents[1] / "system/faults"
HEADERS = Path(fmpy.__file__).parent / "c-code"
PLATFORMS = {2: fmpy.platform, 3: fmpy.platform_tuple}
#: macro step (s) and number of steps of every run here; the FMUs' DefaultExperiment says the same
STEP, STEP_COUNT = 0.01, 10
NO_CHANGES: Mapping[str, str] = {}
#: functions that have another name in FMI 3.0
IN_FMI3 = {
    "Instantiate": "InstantiateCoSimulation",
    "GetReal": "GetFloat64",
    "SetReal": "SetFloat64",
}


def function_name(version: int, name: str) -> str:
    """The C function for its FMI 2.0 name without prefix."""
    return f"fmi{version}{IN_FMI3.get(name, name) if version == 3 else name}"


def build_library(version: int, folder: Path) -> Path:
    """The misbehaving lag of an FMI version as shared library."""
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library = folder / f"fault{version}.so"
    sources = [HERE / f"fault{version}.c", HERE / "fault_actions.c", HERE / "attacks.c"]
    options = ["-shared", "-fPIC", "-O1", "-Wl,-Bsymbolic", f"-I{HEADERS}"]
    subprocess.run(
        [compiler, *options, *sources, "-o", library, "-lm", "-lpthread", "-lrt"], check=True
    )
    return library


def changed(text: str, changes: Mapping[str, str]) -> str:
    for old, new in changes.items():
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return text


@dataclass(frozen=True)
class FaultFmus:
    """`fmus(2, "DoStep 6 segv")` is an FMI 2.0 FMU that crashes in its sixth step; the orders stand
    in fault_actions.h, with
    the names of FMI 2.0 for both versions. `changes` replaces words of its description; `attacks`
    are lines for the order "attack".

    Each of its calls, and what became of an order, is a line in the file `calls`.
    """

    libraries: dict[int, Path]
    folder: Path

    def __call__(
        self,
        version: int,
        order: str = "",
        name: str = "lag",
        changes: Mapping[str, str] = NO_CHANGES,
        attacks: str = "",
    ) -> Path:
        target = self.folder / f"{name}.fmu"
        where, _, rest = order.partition(" ")
        order = f"{IN_FMI3.get(where, where) if version == 3 else where} {rest}"
        with ZipFile(target, "w") as archive:
            archive.writestr(
                "modelDescription.xml", changed((HERE / f"fault{version}.xml").read_text(), changes)
            )
            archive.write(self.libraries[version], f"binaries/{PLATFORMS[version]}/fault.so")
            archive.writestr(
                "resources/fault.txt", f"fault {order}\nrecord {self.calls}\n{attacks}"
            )
        return target

    @property
    def calls(self) -> Path:
        return self.folder / "calls.txt"

    def lines(self, word: str = "") -> list[str]:
        """The recorded lines, or those that begin with a word."""
        text = self.calls.read_text(errors="replace") if self.calls.exists() else ""
        return [line.rstrip() for line in text.splitlines() if line.startswith(word)]


def scenario(
    folder: Path, fmu: Path, deadlines: dict[str, float] | None = None, **more: Any
) -> Path:
    """A scenario with the FMU as its component `lag`; `more` replaces keys."""
    content = {
        "name": "fault",
        "stop_time": STEP * STEP_COUNT,
        "step_size": STEP,
        "components": {"lag": {"fmu": str(fmu)}},
        **({"deadlines": deadlines} if deadlines else {}),
        **more,
    }
    path = folder / "fault.json"
    path.write_text(json.dumps(content))
    return path


def lag_output(n: int, y: float = 1.0, lag_time: float = 0.5) -> float:
    """Output of the lag after n Euler steps without input, in the order of the C source's
    operations.
    """
    for _ in range(n):
        y += STEP * (0.0 - y) / lag_time
    return y
