"""Cost of FMUs in separate processes: per FMU and step, at start, and in memory.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_isolated_fmus.py
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from statistics import median
from time import perf_counter

import pytest
from cosim_contender import STEP, executors
from cost_measurement import ROUNDS, print_heading
from lag_fmus import lag_fmu

from cosim.components.fmi import FmuFile, Isolation, create_component
from cosim.core.system import Endpoint, System
from cosim.engine import ExecutorKind, Recorder, compile_plan, executor_class
from cosim.engine.initialization import instantiate_components
from cosim.engine.plan_run import SimulationOutcome, simulate
from cosim.engine.settings import Settings

STEPS, BATCH, WIDTH, STARTS = 5_000, 50, 16, 20
#: documented costs on an idle machine: additional time per FMU and step (us), time to start (ms)
DOCUMENTED_STEP, DOCUMENTED_START = 15, 60
#: limits for a machine under load: ratio to two bare processes, ratio to the documented cost
LARGEST_RATIO, LOAD_FACTOR = 20, 4
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(900)]


def lags(fmu: Path, size: int, isolation: Isolation | None) -> System:
    """Return a system of `size` unconnected FMUs with 16 inputs and 16 outputs each."""
    file = FmuFile(fmu)
    names = [f"s{i}" for i in range(size)]
    return System(
        {name: create_component(file, name, isolation=isolation) for name in names},
        (),
        (tuple(names),),
    )


def run(
    system: System,
    steps: int,
    executor: ExecutorKind,
    observer: Callable[[int, int], None] | None = None,
) -> SimulationOutcome:
    columns = {"y": Endpoint("s0", "y1")}
    settings = Settings(Fraction(0), steps * STEP, STEP, columns, executor=executor)
    outcome = simulate(system, settings, [observer] if observer else [])
    assert outcome.failure is None, outcome.failure
    return outcome


def microseconds(run_to: Callable[[int], object]) -> float:
    """Return the wall time (us) of one step: the median over batches; `run_to(n)` runs until step
    n.
    """
    durations = []
    for n in range(BATCH, STEPS + 1, BATCH):
        start = perf_counter()
        run_to(n)
        durations.append(perf_counter() - start)
    return median(durations) / BATCH * 1e6


def per_step(fmu: Path, isolation: Isolation | None, kind: ExecutorKind) -> float:
    """Return the wall time (us) of a macro step of one FMU."""
    system = lags(fmu, 1, isolation)
    plan = compile_plan(
        system, Settings(Fraction(0), STEPS * STEP, STEP, {"y": Endpoint("s0", "y1")})
    )
    executor = executor_class(kind)(plan, Recorder(plan))
    try:
        instantiate_components(plan)
        executor.initialize()
        return microseconds(executor.run)
    finally:
        system.components["s0"].free()


def round_trip() -> float:
    """Return the wall time (us) of one line to a bare child process and back, which is the lower
    bound.
    """
    requests, answers = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        os.close(requests[1])
        while line := os.read(requests[0], 100):
            os.write(answers[1], line)
        os._exit(0)
    cost = microseconds(
        lambda _n: [(os.write(requests[1], b"\n"), os.read(answers[0], 100)) for _ in range(BATCH)]
    )
    for descriptor in (*requests, *answers):
        os.close(descriptor)
    os.waitpid(child, 0)
    return cost


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_steps(version, tmp_path):
    fmu = lag_fmu(tmp_path, version, WIDTH)
    print_heading(
        f"one FMI {version}.0 FMU, {WIDTH} inputs and outputs, {STEPS} steps", "median us per step"
    )
    for executor in executors():
        rounds = [
            (per_step(fmu, None, executor), per_step(fmu, Isolation(), executor), round_trip())
            for _ in range(ROUNDS)
        ]
        in_process, isolated, bare = (median(column) for column in zip(*rounds, strict=True))
        additional = median(isolated - in_process for in_process, isolated, _ in rounds)
        print(
            f"  {executor:12} in process {in_process:.2f}, isolated {isolated:.2f},"
            f" additional {additional:.2f} (documented {DOCUMENTED_STEP}); two bare processes "
            f"{bare:.2f}"
        )
        assert (
            median((isolated - in_process) / bare for in_process, isolated, bare in rounds)
            < LARGEST_RATIO
        )


def test_starts(tmp_path):
    fmu = lag_fmu(tmp_path, 2, WIDTH)
    print_heading(f"to extract, load and instantiate {STARTS} instances of one FMU", "ms each")
    run(lags(fmu, 1, Isolation()), 1, "auto")  # imports
    costs = {}
    for name, isolation in (
        ("in process", None),
        ("isolated", Isolation()),
        ("sandbox", Isolation(sandbox=True)),
    ):
        rounds = [
            run(lags(fmu, STARTS, isolation), 1, "auto").timing["instantiate_seconds"]
            for _ in range(ROUNDS)
        ]
        costs[name] = median(rounds) / STARTS * 1e3
        print(f"  {name:12} {costs[name]:.2f} (documented {DOCUMENTED_START})")
    assert costs["sandbox"] < LOAD_FACTOR * DOCUMENTED_START


def own_memory(process: str) -> int:
    """Return the private memory of a process (bytes)."""
    text = Path(f"/proc/{process}/smaps_rollup").read_text()
    return sum(
        1024 * int(size) for size in re.findall(r"^Private_\w+: +(\d+) kB", text, re.MULTILINE)
    )


def test_memory(tmp_path):
    peaks: list[int] = []

    def measure_workers(_finished: int, _count: int) -> None:
        workers = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
        peaks.append(max(own_memory(worker) for worker in workers))

    run(lags(lag_fmu(tmp_path, 2, WIDTH), 4, Isolation()), 100, "auto", measure_workers)
    print_heading("private memory of a worker", "MB")
    print(f"  {peaks[-1] / 1e6:.1f} (at the start {peaks[0] / 1e6:.1f})")
    assert peaks[-1] < 30e6
