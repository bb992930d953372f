"""Ecos: one batch step, a CSV writer of one variable. The library needs libtbb, which the package
tbb provides.
"""

import ctypes
import sys
import tempfile
from pathlib import Path

from driver import STEP, Clock, Outcome, Ring, main


def run(ring: Ring) -> Outcome:
    for library in sorted(Path(sys.prefix, "lib").glob("libtbb.so.*"))[:1]:
        ctypes.CDLL(str(library), mode=ctypes.RTLD_GLOBAL)
    from ecospy.EcosSimulation import EcosSimulation
    from ecospy.EcosSimulationStructure import EcosSimulationStructure

    with tempfile.TemporaryDirectory() as folder, EcosSimulationStructure() as structure:
        for name in ring.names:
            structure.add_model(name, ring.fmu)
        for source, target in ring.pairs:
            structure.make_real_connection(f"{source}::y1", f"{target}::u1")
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.add_csv_writer(str(Path(folder, "result.csv")), identifiers=["s0::y1"])
            simulation.init()
            simulation.step(1)
            with Clock() as clock:
                simulation.step(ring.steps)
            return clock.cpu, clock.wall, simulation.get_real("s0::y1")


if __name__ == "__main__":
    main(run)
