"""FMU Manipulation Toolbox: `fmucontainer` packs the ring into one FMU, which the program of the C
limit steps.

python pack_fmt.py FMU SIZE CONTAINER
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from driver import STEP, Ring


def pack(ring: Ring, container: Path) -> None:
    with tempfile.TemporaryDirectory() as folder:
        for name in ring.names:  # fmucontainer needs one file per instance
            shutil.copy(ring.fmu, Path(folder, f"{name}.fmu"))
        rows = ["rule;from_fmu;from_port;to_fmu;to_port"]
        rows += [f"FMU;{name}.fmu;;;" for name in ring.names]
        rows += [f"LINK;{source}.fmu;y1;{target}.fmu;u1" for source, target in ring.pairs]
        rows.append("OUTPUT;s0.fmu;y1;;y1")
        Path(folder, "ring.csv").write_text("\n".join(rows) + "\n")
        program = Path(sys.executable).with_name("fmucontainer")
        command = [program, "-container", f"ring.csv:{STEP}", "-fmu-directory", folder]
        subprocess.run(command, check=True, cwd=folder, capture_output=True)
        shutil.copy(Path(folder, "ring.fmu"), container)


if __name__ == "__main__":
    pack(Ring(sys.argv[1], int(sys.argv[2]), 0), Path(sys.argv[3]))
