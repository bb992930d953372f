"""What the landing envelope costs: processor time of a landing of 35 s, and what 1000 of them take on two cores."""

import os
from resource import RUSAGE_CHILDREN, getrusage
from time import perf_counter

import pytest

from cosim.studies.execution.local import LocalRunner
from cosim.studies.sweep import Sweep

pytestmark = pytest.mark.benchmark

#: landings of one measurement, spread evenly over the envelope
RUNS = 48


def spent():
    used = getrusage(RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def costs(sweep, workers, count):
    """Processor time and wall time (s) of so many landings, the start of the engine included."""
    began, before = perf_counter(), spent()
    with LocalRunner(sweep.study.order, workers) as engine:
        jobs = [sweep.study.job(sweep.design[k * len(sweep) // count].settings) for k in range(count)]
        assert not any(record.failure for record in engine.run_jobs(jobs))
    return spent() - before, perf_counter() - began


@pytest.mark.parametrize("workers", [1, 2])
def test_cost_of_a_landing(workers):
    sweep = Sweep.from_file("landing_envelope")
    start_cpu, start_wall = costs(sweep, workers, 2)
    cpu, wall = costs(sweep, workers, RUNS)
    cpu, wall = (cpu - start_cpu) / (RUNS - 2), (wall - start_wall) / (RUNS - 2)
    print(f"\n  {workers} workers, load average {os.getloadavg()[0]:.1f}: {1e3 * cpu:.0f} ms processor time a landing")
    print(f"  1000 landings: {1000 * wall:.0f} s as it was, {500 * cpu:.0f} s on two cores that do nothing else")
