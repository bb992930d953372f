"""SysSimX: System.run, Gauss-Seidel by default."""

import logging

from driver import STEP, Clock, Outcome, Ring, main
from syssimx import Connection, System
from syssimx.components.fmu import FMUComponent


def run(ring: Ring) -> Outcome:
    logging.disable(logging.CRITICAL)
    system = System("ring")
    for name in ring.names:
        system.add_component(FMUComponent(name, ring.fmu))
    for source, target in ring.pairs:
        system.add_connection(Connection(source, "y1", target, "u1"))
    system.initialize(t0=0.0)
    system.run(0.0, 5 * STEP, STEP)
    with Clock() as clock:
        system.run(system.t, system.t + ring.steps * STEP, STEP)
    _, signals = system.get_history()["s0"]
    return clock.cpu, clock.wall, float(signals["y1"][-1])


if __name__ == "__main__":
    main(run)
