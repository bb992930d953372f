"""Probe FMUs: small FMUs of both FMI versions in C, built once per test session."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from zipfile import ZipFile

import fmpy
import pytest

PROBE_SOURCES = Path(__file__).parents[1] / "components/fmi/foreign"
HEADERS = Path(fmpy.__file__).parent / "c-code"


def build_probe_fmu(
    version: int, folder: Path, identifier: str = "probe", name: str = "", flags: str = ""
) -> Path:
    """Build the probe FMU of an FMI major version, or the one of another source.

    Args:
        version: FMI major version.
        folder: Folder of the FMU.
        identifier: File name of its library.
        name: Name of the C file and of the XML file; by default "probe2" or "probe3".
        flags: Further attributes of its Co-Simulation interface.
    """
    name = name or f"probe{version}"
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    library, target = folder / f"{name}.so", folder / f"{name}.fmu"
    source = PROBE_SOURCES / f"{name}.c"
    subprocess.run(
        [compiler, "-shared", "-fPIC", "-O0", f"-I{HEADERS}", source, "-o", library], check=True
    )
    with ZipFile(target, "w") as archive:
        description = (PROBE_SOURCES / f"{name}.xml").read_text()
        archive.writestr(
            "modelDescription.xml", description.replace("<CoSimulation ", f"<CoSimulation {flags} ")
        )
        platform = fmpy.platform if version == 2 else fmpy.platform_tuple
        archive.write(library, f"binaries/{platform}/{identifier}.so")
    return target


@pytest.fixture(scope="session")
def probes(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Path]:
    """Paths of the probe FMUs by FMI major version."""
    folder = tmp_path_factory.mktemp("probes")
    return {version: build_probe_fmu(version, folder) for version in (2, 3)}


@pytest.fixture(params=[2, 3], ids=["FMI2", "FMI3"])
def probe(request: pytest.FixtureRequest, probes: dict[int, Path]) -> Path:
    """Path of the probe FMU, for each FMI version."""
    path: Path = probes[request.param]
    return path
