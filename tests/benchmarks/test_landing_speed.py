"""Cost of the landing envelope: processor time of a landing of 35 s, and time of 1000 landings on
two cores.
"""

import os
from resource import RUSAGE_CHILDREN, getrusage
from time import perf_counter

import pytest

from cosim.studies.execution.worker_pool import LocalRunner
from cosim.studies.sweep import Sweep

pytestmark = pytest.mark.benchmark

#: landings per measurement, distributed evenly over the envelope
RUNS = 48


def children_cpu_time():
    used = getrusage(RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def costs(sweep, workers, count):
    """Return processor time and wall time (s) of `count` landings, including the start of the
    workers.
    """
    start, before = perf_counter(), children_cpu_time()
    with LocalRunner(sweep.study.context, workers) as runner:
        jobs = [
            sweep.study.job(sweep.design[k * len(sweep) // count].settings) for k in range(count)
        ]
        assert not any(record.failure for record in runner.run_jobs(jobs))
    return children_cpu_time() - before, perf_counter() - start


@pytest.mark.parametrize("workers", [1, 2])
def test_cost_of_a_landing(workers):
    sweep = Sweep.from_file("landing_envelope")
    start_cpu, start_wall = costs(sweep, workers, 2)
    cpu, wall = costs(sweep, workers, RUNS)
    cpu, wall = (cpu - start_cpu) / (RUNS - 2), (wall - start_wall) / (RUNS - 2)
    print(
        f"\n  {workers} workers, load average {os.getloadavg()[0]:.1f}: {1e3 * cpu:.0f} ms "
        "processor time a landing"
    )
    print(f"  1000 landings: {1000 * wall:.0f} s as measured, {500 * cpu:.0f} s on two idle cores")
