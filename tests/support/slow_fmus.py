"""FMUs with slow steps, for tests of parallel execution."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from zipfile import ZipFile

import fmpy
from probe_fmus import HEADERS, PROBE_SOURCES

SOURCE = Path(__file__).parents[1] / "engine/slow_probe.c"


def slow_fmu(folder: Path, name: str, seconds: float, wait: bool = False, *macros: str) -> Path:
    """Build the FMI 2.0 probe with a slow doStep.

    Each step takes `seconds` (s) of computing, or of sleeping if `wait`. Further macros are defined
    in slow_probe.c.
    """
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library, target = folder / f"{name}.so", folder / f"{name}.fmu"
    defined = [f"BUSY_NS={round(seconds * 1e9)}LL", *(["WAIT"] if wait else []), *macros]
    flags = [
        "-shared",
        "-fPIC",
        "-O2",
        "-w",
        *(f"-D{macro}" for macro in defined),
        f"-I{HEADERS}",
        f"-I{PROBE_SOURCES}",
    ]
    subprocess.run([compiler, *flags, SOURCE, "-o", library], check=True)
    with ZipFile(target, "w") as archive:
        archive.write(PROBE_SOURCES / "probe2.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{fmpy.platform}/probe.so")
    return target
