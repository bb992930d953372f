"""cosim as a contender: a ring of FMUs or one FMU, simulated by `simulate`."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from cost_measurement import Stopwatch

from cosim.components.fmi import FmuFile, create_component
from cosim.core.system import Connection, Endpoint, System
from cosim.engine import ExecutorKind, native_available
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

STEP = Fraction(1, 100)


def ring_system(fmu: Path, size: int) -> System:
    """Return a ring of `size` instances in one stage (Jacobi): the outputs of each feed the inputs
    of the next.
    """
    file = FmuFile(fmu)
    names = [f"s{i}" for i in range(size)]
    inputs = [
        variable.name for variable in file.description.variables if variable.causality == "input"
    ]
    connections = []
    for a, b in zip(names, [*names[1:], *names[:1]], strict=True):
        for name in inputs:
            connections.append(Connection(Endpoint(a, f"y{name[1:]}"), Endpoint(b, name)))
    return System(
        {name: create_component(file, name) for name in names}, connections, (tuple(names),)
    )


def single_fmu_system(fmu: Path) -> System:
    """Return a system of one instance with unconnected inputs."""
    return System({"s0": create_component(FmuFile(fmu), "s0")}, (), (("s0",),))


def cpu_per_step(
    system: System, steps: int, recorded: Sequence[str], executor: ExecutorKind
) -> float:
    """Return the CPU time (us) per macro step."""
    return measure_run(system, steps, recorded, executor).cpu


def measure_run(
    system: System, steps: int, recorded: Sequence[str], executor: ExecutorKind
) -> Stopwatch:
    """Simulate once and return the times; a ring of lags must stay at 1 exactly."""
    columns = {name: Endpoint(*name.split(".")) for name in recorded}
    watch = Stopwatch()
    run = simulate(
        system, Settings(Fraction(0), steps * STEP, STEP, columns, executor=executor), [watch]
    )
    if run.failure:
        raise run.failure
    assert not system.connections or all(
        values[-1] == 1.0 for values in run.recording.columns.values()
    )
    return watch


def executors() -> list[ExecutorKind]:
    """Return the executors of this installation, the fastest first."""
    return ["native", "python"] if native_available() else ["python"]


def executor_label(executor: ExecutorKind) -> str:
    return f"cosim, {executor}"
