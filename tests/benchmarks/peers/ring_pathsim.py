"""PathSim with pathsim-fmi."""

from driver import STEP, Clock, Outcome, Ring, main
from pathsim import Connection, Simulation
from pathsim_fmi import CoSimulationFMU


def run(ring: Ring) -> Outcome:
    blocks = {name: CoSimulationFMU(ring.fmu, instance_name=name, dt=STEP) for name in ring.names}
    connections = [Connection(blocks[source], blocks[target]) for source, target in ring.pairs]
    simulation = Simulation(list(blocks.values()), connections, dt=STEP, log=False)
    simulation.run(5 * STEP)
    with Clock() as clock:
        simulation.run(ring.steps * STEP, reset=False)
    return clock.cpu, clock.wall, float(blocks["s0"].outputs.to_array()[0])


if __name__ == "__main__":
    main(run)
