"""FMPy: simulate_ssp."""

import tempfile
from pathlib import Path
from zipfile import ZipFile

from driver import STEP, Outcome, Ring, main, time_whole_runs
from fmpy.ssp.simulation import simulate_ssp

SYSTEM = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
 xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="ring">
<ssd:System name="ring">
<ssd:Elements>{components}</ssd:Elements><ssd:Connections>{connections}</ssd:Connections>
</ssd:System></ssd:SystemStructureDescription>"""
COMPONENT = """<ssd:Component name="{}" type="application/x-fmu-sharedlibrary"
 source="resources/Lag.fmu"><ssd:Connectors>
<ssd:Connector name="u1" kind="input"><ssc:Real/></ssd:Connector>
<ssd:Connector name="y1" kind="output"><ssc:Real/></ssd:Connector>
</ssd:Connectors></ssd:Component>"""
CONNECTION = (
    '<ssd:Connection startElement="{}" startConnector="y1" endElement="{}" endConnector="u1"/>'
)


def run(ring: Ring) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        ssp = Path(folder, "ring.ssp")
        components = "".join(COMPONENT.format(name) for name in ring.names)
        connections = "".join(CONNECTION.format(*pair) for pair in ring.pairs)
        with ZipFile(ssp, "w") as archive:
            archive.writestr(
                "SystemStructure.ssd", SYSTEM.format(components=components, connections=connections)
            )
            archive.write(ring.fmu, "resources/Lag.fmu")

        def simulate(steps: int) -> float:
            result = simulate_ssp(str(ssp), stop_time=steps * STEP, step_size=STEP)
            return float(result[result.dtype.names[-1]][-1])

        return time_whole_runs(simulate, ring.steps)


if __name__ == "__main__":
    main(run)
