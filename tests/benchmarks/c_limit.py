"""The C limit (programs/climit.c): a plain C loop over the FMI calls, the lower bound for every
importer.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

from fmpy import extract, platform, platform_tuple, read_model_description, sharedLibraryExtension
from lag_fmus import PROGRAMS

from cosim.export.fmu.compiler import find_compiler
from cosim.export.fmu.package import fmi_headers


class CLimit:
    """The program of the C limit, compiled for one FMU."""

    def __init__(self, fmu: Path, folder: Path):
        description = read_model_description(fmu)
        version = int(description.fmiMajorVersion)
        identifier = description.coSimulation.modelIdentifier
        extracted = Path(extract(fmu, folder / f"{fmu.stem}_extracted"))
        binary = (
            "binaries",
            platform if version == 2 else platform_tuple,
            f"{identifier}{sharedLibraryExtension}",
        )
        self._library, resources = extracted.joinpath(*binary), extracted / "resources"
        self._resources = resources.as_uri() if version == 2 else f"{resources}/"
        self._token = description.instantiationToken
        references = {v.causality: v.valueReference for v in reversed(description.modelVariables)}
        self._first = [references.get("input", 0), references["output"]]
        self._program = _compile(version, folder)

    def __call__(
        self, size: int, steps: int, width: int = 1, recorded: int = 1, ring: bool = True
    ) -> float:
        """Return the CPU time (us) per step of `size` instances in a ring, or of one instance; a
        ring must stay at 1.
        """
        microseconds, last = self.run(size, steps, width, recorded, ring)
        assert last == 1.0 or not ring
        return microseconds

    def run(
        self, size: int, steps: int, width: int = 1, recorded: int = 1, ring: bool = True
    ) -> tuple[float, float]:
        """Return the CPU time (us) per step and the last recorded value."""
        words = [
            self._library,
            self._token,
            self._resources,
            int(ring),
            size,
            width,
            *self._first,
            recorded,
            steps,
        ]
        done = subprocess.run(
            [self._program, *map(str, words)], capture_output=True, text=True, check=True
        )
        microseconds, last = map(float, done.stdout.split())
        return microseconds, last


def _compile(fmi_version: int, folder: Path) -> Path:
    for name, text in fmi_headers(fmi_version).items():
        (folder / name).write_bytes(text)
    program = folder / f"climit{fmi_version}"
    header = f'-DCALLS="fmi{fmi_version}_calls.h"'
    command = [
        *find_compiler(),
        "-O2",
        header,
        f"-I{folder}",
        PROGRAMS / "climit.c",
        "-o",
        program,
        "-ldl",
    ]
    subprocess.run(command, check=True)
    return program
