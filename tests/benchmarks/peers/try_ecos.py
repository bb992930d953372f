"""Ecos: simulates an FMU alone. The library needs libtbb, which the package tbb provides.

python try_ecos.py FMU START STOP STEP
"""

import ctypes
import sys
from pathlib import Path

path, start, stop, step = sys.argv[1], *map(float, sys.argv[2:])
for library in sorted(Path(sys.prefix, "lib").glob("libtbb.so.*"))[:1]:
    ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
from ecospy.EcosSimulation import EcosSimulation  # noqa: E402 - libtbb has to be loaded before
from ecospy.EcosSimulationStructure import EcosSimulationStructure  # noqa: E402

with EcosSimulationStructure() as structure:
    structure.add_model("fmu", path)
    with EcosSimulation(structure=structure, step_size=step) as simulation:
        simulation.init(start)
        while simulation.get_time() < stop - step / 2:
            before = simulation.get_time()
            simulation.step(1)
            if simulation.get_time() <= before:
                sys.exit(f"no progress at t = {before}")
        print(simulation.get_time())
