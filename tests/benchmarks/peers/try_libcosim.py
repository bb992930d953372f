"""libcosim: simulates an FMU alone, as an OSP system structure with one simulator.

python try_libcosim.py FMU START STOP STEP
"""

import shutil
import sys
import tempfile
from pathlib import Path

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level

SYSTEM = """<?xml version="1.0" encoding="utf-8" ?>
<OspSystemStructure xmlns="http://opensimulationplatform.com/MSMI/OSPSystemStructure" version="0.1">
<StartTime>{start}</StartTime>
<BaseStepSize>{step}</BaseStepSize><Algorithm>fixedStep</Algorithm>
<Simulators><Simulator name="fmu" source="Model.fmu"/></Simulators></OspSystemStructure>"""

path, start, stop, step = sys.argv[1], *map(float, sys.argv[2:])
log_output_level(CosimLogLevel.ERROR)
with tempfile.TemporaryDirectory() as folder:
    shutil.copy(path, Path(folder, "Model.fmu"))
    Path(folder, "OspSystemStructure.xml").write_text(SYSTEM.format(start=start, step=step))
    execution = CosimExecution.from_osp_config_file(folder)
    for _ in range(round((stop - start) / step)):
        if not execution.step():
            sys.exit("step failed")
    print(execution.status().current_time)
