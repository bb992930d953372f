"""What it costs to give each FMU a process of its own: per FMU and step, to start, and in memory.

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
from cosim.core.time_grid import TimeGrid
from cosim.engine import ExecutorKind, Recorder, compile_plan, executor_class
from cosim.engine.initialization import instantiate_components
from cosim.engine.run_loop import SimulationOutcome, simulate
from cosim.engine.settings import Settings

STEPS, BATCH, WIDTH, STARTS = 5_000, 50, 16, 20
#: what is promised on a quiet machine: us per FMU and step over in process, ms to start
PROMISED_STEP, PROMISED_START = 15, 60
#: generous, for a busy one: times the cost of two bare processes, times what is promised
LARGEST_RATIO, BUSY = 20, 4
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(900)]


def lags(fmu: Path, size: int, isolation: Isolation | None) -> System:
    """`size` FMUs with 16 inputs and outputs each, unconnected."""
    file = FmuFile(fmu)
    names = [f"s{i}" for i in range(size)]
    return System({name: create_component(file, name, isolation=isolation) for name in names}, (), (tuple(names),))


def run(system: System, steps: int, executor: ExecutorKind, look: Callable[[int, int], None] | None = None) -> SimulationOutcome:
    columns = {"y": Endpoint("s0", "y1")}
    settings = Settings(Fraction(0), steps * STEP, STEP, columns, executor=executor)
    outcome = simulate(system, settings, [look] if look else [])
    assert outcome.failure is None, outcome.failure
    return outcome


def microseconds(reach: Callable[[int], object]) -> float:
    """Wall time of one step; the median of batches, after each of which a step is reached."""
    durations = []
    for n in range(BATCH, STEPS + 1, BATCH):
        began = perf_counter()
        reach(n)
        durations.append(perf_counter() - began)
    return median(durations) / BATCH * 1e6


def per_step(fmu: Path, isolation: Isolation | None, kind: ExecutorKind) -> float:
    """Wall time in us of a macro step of one FMU."""
    system = lags(fmu, 1, isolation)
    plan = compile_plan(system, TimeGrid.from_times(Fraction(0), STEPS * STEP, STEP), [Endpoint("s0", "y1")])
    executor = executor_class(kind)(plan, Recorder(plan, {"y": Endpoint("s0", "y1")}))
    try:
        instantiate_components(plan)
        executor.initialize()
        return microseconds(executor.run)
    finally:
        system.components["s0"].free()


def round_trip() -> float:
    """Wall time in us of a line there and back between two processes that do nothing else: the floor."""
    here, there = os.pipe(), os.pipe()
    child = os.fork()
    if child == 0:
        os.close(here[1])
        while line := os.read(here[0], 100):
            os.write(there[1], line)
        os._exit(0)
    cost = microseconds(lambda n: [(os.write(here[1], b"\n"), os.read(there[0], 100)) for _ in range(BATCH)])
    for descriptor in (*here, *there):
        os.close(descriptor)
    os.waitpid(child, 0)
    return cost


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_steps(version, tmp_path):
    fmu = lag_fmu(tmp_path, version, WIDTH)
    print_heading(f"one FMI {version}.0 FMU, {WIDTH} inputs and outputs, {STEPS} steps", "median us per step")
    for executor in executors():
        rounds = [(per_step(fmu, None, executor), per_step(fmu, Isolation(), executor), round_trip()) for _ in range(ROUNDS)]
        here, apart, floor = (median(column) for column in zip(*rounds, strict=True))
        over = median(apart - here for here, apart, _ in rounds)
        print(
            f"  {executor:12} in process {here:.2f}, apart {apart:.2f}, over in process {over:.2f} (promised {PROMISED_STEP});"
            f" two bare processes {floor:.2f}"
        )
        assert median((apart - here) / floor for here, apart, floor in rounds) < LARGEST_RATIO


def test_starts(tmp_path):
    fmu = lag_fmu(tmp_path, 2, WIDTH)
    print_heading(f"to extract, load and instantiate {STARTS} instances of one FMU", "ms each")
    run(lags(fmu, 1, Isolation()), 1, "auto")  # imports
    costs = {}
    for name, isolation in (("in process", None), ("apart", Isolation()), ("sandbox", Isolation(sandbox=True))):
        rounds = [run(lags(fmu, STARTS, isolation), 1, "auto").timing["instantiate_seconds"] for _ in range(ROUNDS)]
        costs[name] = median(rounds) / STARTS * 1e3
        print(f"  {name:12} {costs[name]:.2f} (promised {PROMISED_START})")
    assert costs["sandbox"] < BUSY * PROMISED_START


def own_memory(process: str) -> int:
    """Bytes that belong to a process alone."""
    text = Path(f"/proc/{process}/smaps_rollup").read_text()
    return sum(1024 * int(size) for size in re.findall(r"^Private_\w+: +(\d+) kB", text, re.MULTILINE))


def test_memory(tmp_path):
    found: list[int] = []

    def look(finished: int, count: int) -> None:
        workers = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
        found.append(max(own_memory(worker) for worker in workers))

    run(lags(lag_fmu(tmp_path, 2, WIDTH), 4, Isolation()), 100, "auto", look)
    print_heading("memory of a worker that no other process has", "MB")
    print(f"  {found[-1] / 1e6:.1f} (at the start {found[0] / 1e6:.1f})")
    assert found[-1] < 30e6
