"""CoFmuPy: Coordinator.do_step in a loop."""

import contextlib
import io
import json
import tempfile
from pathlib import Path

from cofmupy import Coordinator
from driver import STEP, Clock, Outcome, Ring, main


def run(ring: Ring) -> Outcome:
    configuration = {
        "fmus": [{"id": name, "path": ring.fmu} for name in ring.names],
        "connections": [
            {"source": {"id": source, "variable": "y1"}, "target": {"id": target, "variable": "u1"}}
            for source, target in ring.pairs
        ],
        "cosim_method": "jacobi",
        "iterative": False,
        "root": "",
    }
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "configuration.json")
        file.write_text(json.dumps(configuration))
        coordinator = Coordinator()
        with contextlib.redirect_stdout(io.StringIO()):
            coordinator.start(str(file))
        coordinator.do_step(STEP)
        with Clock() as clock:
            for _ in range(ring.steps):
                coordinator.do_step(STEP)
        results = coordinator.get_results()
    last = next(values[-1] for key, values in results.items() if tuple(key) == ("s0", "y1"))
    return clock.cpu, clock.wall, float(last)


if __name__ == "__main__":
    main(run)
