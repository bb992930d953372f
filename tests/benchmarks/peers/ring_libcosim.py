"""libcosim: an OSP system structure, one batch step, a time series observer.

CosimExecution.add_local_slave of version 0.0.6 crashes the process, so the system is read from a
file.
"""

import shutil
import tempfile
from pathlib import Path
from xml.etree import ElementTree
from zipfile import ZipFile

from driver import STEP, Clock, Outcome, Ring, main
from libcosimpy.CosimEnums import CosimVariableType
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver

SYSTEM = """<?xml version="1.0" encoding="utf-8" ?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
<StartTime>0.0</StartTime>
<BaseStepSize>{step}</BaseStepSize>
<Algorithm>fixedStep</Algorithm><Simulators>{simulators}</Simulators>
<Connections>{connections}</Connections></OspSystemStructure>"""
SIMULATOR = '<Simulator name="{}" source="Lag.fmu"/>'
CONNECTION = """<VariableConnection><Variable simulator="{}" name="y1"/>
<Variable simulator="{}" name="u1"/></VariableConnection>"""


def run(ring: Ring) -> Outcome:
    log_output_level(CosimLogLevel.FATAL)
    reference = _reference(ring.fmu, "y1")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(ring.fmu, Path(folder, "Lag.fmu"))
        simulators = "".join(SIMULATOR.format(name) for name in ring.names)
        connections = "".join(CONNECTION.format(*pair) for pair in ring.pairs)
        text = SYSTEM.format(step=STEP, simulators=simulators, connections=connections)
        Path(folder, "OspSystemStructure.xml").write_text(text)
        execution = CosimExecution.from_osp_config_file(folder)
        series, last = (
            CosimObserver.create_time_series(ring.steps + 10),
            CosimObserver.create_last_value(),
        )
        execution.add_observer(series)
        series.start_time_series(0, reference, CosimVariableType.REAL)
        execution.step()
        with Clock() as clock:
            execution.step(step_count=ring.steps)
        execution.add_observer(last)
        execution.step()
        return clock.cpu, clock.wall, last.last_real_values(0, [reference])[0]


def _reference(fmu: str, name: str) -> int:
    with ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))  # noqa: S314 - written by lag_fmus.py
    return next(
        int(v.attrib["valueReference"])
        for v in root.iter("ScalarVariable")
        if v.get("name") == name
    )


if __name__ == "__main__":
    main(run)
