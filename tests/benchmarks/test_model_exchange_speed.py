"""A Model Exchange FMU integrated at fixed step size, and a plain C loop that makes the same calls.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_model_exchange_speed.py
"""

from __future__ import annotations

import subprocess
from zipfile import ZipFile

import fmpy
import pytest
from cosim_contender import cpu_per_step
from cost_measurement import measure_rounds, print_heading, print_rows
from lag_fmus import PROGRAMS

from cosim.components.fmi import FmuFile, InstanceSettings, SolverSettings, create_component
from cosim.core.system import System
from cosim.engine import native_available
from cosim.export.fmu.compiler import find_compiler
from cosim.export.fmu.package import fmi_headers

STEPS = 1_000_000
#: largest allowed ratio to the plain C loop (generous; the goal is 1.5)
LARGEST_RATIO = 20
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Lag" guid="lag" numberOfEventIndicators="0">
<ModelExchange modelIdentifier="lag"/>
<ModelVariables>
<ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
<ScalarVariable name="y1" valueReference="1" causality="output" initial="exact">
<Real start="1"/></ScalarVariable>
<ScalarVariable name="der(x)" valueReference="2" causality="local">
<Real derivative="2"/></ScalarVariable>
</ModelVariables>
<ModelStructure><Outputs><Unknown index="2"/></Outputs>
<Derivatives><Unknown index="3"/></Derivatives></ModelStructure>
</fmiModelDescription>"""
pytestmark = [
    pytest.mark.benchmark,
    pytest.mark.skipif(not native_available(), reason="the native executor was not built"),
]


def build(folder):
    """Return the FMU, its library and the program with the loop."""
    for name, text in fmi_headers(2).items():
        (folder / name).write_bytes(text)
    library, program, fmu = folder / "lag.so", folder / "loop", folder / "lag.fmu"
    command = [*find_compiler(), "-O2", f"-I{folder}", str(PROGRAMS / "exchange_lag.c")]
    subprocess.run([*command, "-shared", "-fPIC", "-o", library], check=True)
    subprocess.run([*command, "-DLOOP", "-o", program, "-ldl"], check=True)
    with ZipFile(fmu, "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.write(library, f"binaries/{fmpy.platform}/lag.so")
    return fmu, library, program


def test_an_fmu_at_fixed_step_size(tmp_path):
    fmu, library, program = build(tmp_path)

    def loop():
        done = subprocess.run(
            [program, library, str(STEPS)], capture_output=True, text=True, check=True
        )
        return float(done.stdout.split()[0])

    def cosim():
        component = create_component(
            FmuFile(fmu), "s0", InstanceSettings(solver=SolverSettings("euler"))
        )
        return cpu_per_step(System({"s0": component}, (), (("s0",),)), STEPS, ["s0.y1"], "native")

    print_heading(f"one Model Exchange FMU, Euler's method, {STEPS} steps, one signal recorded")
    ratios = print_rows("one FMU", measure_rounds({"plain C loop": loop, "cosim, native": cosim}))
    assert ratios["cosim, native"] < LARGEST_RATIO
