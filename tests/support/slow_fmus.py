"""FMUs whose steps take long, for what runs on threads."""

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
    """The FMI 2.0 probe with a doStep that takes so long, working or waiting (see slow_probe.c, also for further macros)."""
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library, target = folder / f"{name}.so", folder / f"{name}.fmu"
    defined = [f"BUSY_NS={round(seconds * 1e9)}LL", *(["WAIT"] if wait else []), *macros]
    flags = ["-shared", "-fPIC", "-O2", "-w", *(f"-D{macro}" for macro in defined), f"-I{HEADERS}", f"-I{PROBE_SOURCES}"]
    subprocess.run([compiler, *flags, SOURCE, "-o", library], check=True)
    with ZipFile(target, "w") as archive:
        archive.write(PROBE_SOURCES / "probe2.xml", "modelDescription.xml")
        archive.write(library, f"binaries/{fmpy.platform}/probe.so")
    return target
