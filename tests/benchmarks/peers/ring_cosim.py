"""cosim; the fourth argument is the executor. Runs in the environment of the benchmarks."""

import sys
from pathlib import Path

from driver import Outcome, Ring, main

sys.path.append(str(Path(__file__).parents[1]))
import cosim_contender


def run(ring: Ring) -> Outcome:
    watch = cosim_contender.measure_run(
        cosim_contender.ring_system(Path(ring.fmu), ring.size), ring.steps, ["s0.y1"], sys.argv[4]
    )
    return watch.cpu * ring.steps / 1e6, watch.wall * ring.steps / 1e6, 1.0


if __name__ == "__main__":
    main(run)
