"""SOFIRpy: simulate."""

from driver import STEP, Outcome, Ring, main, time_whole_runs
from sofirpy import simulate


def run(ring: Ring) -> Outcome:
    connections = {
        target: [
            {
                "parameter_name": "u1",
                "connect_to_system": source,
                "connect_to_external_parameter": "y1",
            }
        ]
        for source, target in ring.pairs
    }

    def simulate_steps(steps: int) -> float:
        result = simulate(
            stop_time=steps * STEP,
            step_size=STEP,
            fmu_paths=dict.fromkeys(ring.names, ring.fmu),
            connections_config=connections,
            parameters_to_log={"s0": ["y1"]},
        )
        return float(result["s0.y1"].iloc[-1])

    return time_whole_runs(simulate_steps, ring.steps)


if __name__ == "__main__":
    main(run)
