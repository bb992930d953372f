"""Directional derivatives of FMUs, which solve algebraic loops of the initialization."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path
from zipfile import ZipFile

import fmpy
import pytest
from probe_fmus import HEADERS
from systems import make_system, run_system

from cosim.components.fmi import FmuFile, Isolation, create_component

SOURCE = Path(__file__).parent / "foreign/affine.c"
VARIABLES = {
    "u": (1, 'causality="input" start="0"'),
    "y": (2, 'causality="output"'),
    "calls": (3, 'causality="output"'),
}


def description(version):
    if version == 3:
        lines = [
            f'<Float64 name="{name}" valueReference="{number}" {text}/>'
            for name, (number, text) in VARIABLES.items()
        ]
        structure = (
            '<Output valueReference="2" dependencies="1"/><Output valueReference="3" '
            'dependencies=""/>'
        )
        token, flag = "instantiationToken", "providesDirectionalDerivatives"
    else:
        lines = []
        for name, (number, text) in VARIABLES.items():
            causality, _, start = text.partition(" ")
            lines.append(
                f'<ScalarVariable name="{name}" valueReference="{number}" {causality}><Real '
                f"{start}/></ScalarVariable>"
            )
        structure = (
            '<Outputs><Unknown index="2" dependencies="1"/><Unknown index="3" '
            'dependencies=""/></Outputs>'
        )
        token, flag = "guid", "providesDirectionalDerivative"
    return (
        '<?xml version="1.0" encoding="UTF-8"?>'
        f'<fmiModelDescription fmiVersion="{version}.0" modelName="Affine" {token}="affine">'
        '<CoSimulation modelIdentifier="affine" '
        f'{flag}="true"/><ModelVariables>{"".join(lines)}</ModelVariables>'
        f"<ModelStructure>{structure}</ModelStructure></fmiModelDescription>"
    )


@pytest.fixture(scope="module", params=[2, 3], ids=["FMI2", "FMI3"])
def affine(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("affine")
    compiler, library, fmu = (
        os.environ.get("CC") or shutil.which("cc") or "gcc",
        folder / "affine.so",
        folder / "affine.fmu",
    )
    options = ["-shared", "-fPIC", f"-DFMI={request.param}", f"-I{HEADERS}"]
    subprocess.run([compiler, *options, SOURCE, "-o", library], check=True)
    with ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", description(request.param))
        archive.write(
            library,
            f"binaries/{fmpy.platform_tuple if request.param == 3 else fmpy.platform}/affine.so",
        )
    return fmu


@pytest.mark.parametrize("isolation", [None, Isolation()], ids=["here", "isolated"])
def test_a_loop_is_solved_with_one_exact_derivative(affine, isolation):
    """y = 2 y + 1 is linear, so that one step of Newton's method with the exact derivative gives -1
    to the last bit.
    """
    component = create_component(FmuFile(affine), "a", isolation=isolation)
    recording = run_system(make_system({"a": component}, "a.y > a.u"), 1, 1, ["a.y", "a.calls"])
    assert (recording.columns["a.y"][0], recording.columns["a.calls"][0]) == (-1.0, 1.0)
