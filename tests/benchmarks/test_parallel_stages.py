"""Two FMUs in one stage with steps of 1 ms: sequential and on threads.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_parallel_stages.py
"""

from __future__ import annotations

from fractions import Fraction

import pytest
from cosim_contender import executors
from cost_measurement import measure_rounds, print_heading, print_rows
from slow_fmus import slow_fmu

from cosim.components.fmi import FmuFile, create_component
from cosim.core.system import Parallel, System
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings

#: duration of a step (s), number of steps
STEP_DURATION, STEPS = 1e-3, 200
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


def wall_time(fmus, parallel: Parallel, executor) -> float:
    """Return the wall time (us) per macro step."""
    components = {f"c{i}": create_component(FmuFile(fmu), f"c{i}") for i, fmu in enumerate(fmus)}
    built = System(components, (), (tuple(components),), parallel=parallel)
    run = simulate(
        built, Settings(Fraction(0), Fraction(STEPS, 100), Fraction(1, 100), executor=executor)
    )
    assert run.failure is None
    return run.timing["loop_seconds"] / STEPS * 1e6


@pytest.mark.parametrize("wait", [False, True], ids=["busy", "waiting"])
def test_two_long_fmus(wait, tmp_path):
    fmus = [slow_fmu(tmp_path, name, STEP_DURATION, wait) for name in ("a", "b")]
    for executor in executors():
        print_heading(
            f"two FMUs in one stage, 1 ms each, {'waiting' if wait else 'busy'}; {executor}",
            "wall us per step",
        )
        modes: dict[str, Parallel] = {"one thread": False, "threads": "auto"}
        ratios = print_rows(
            "1 ms",
            measure_rounds(
                {
                    name: lambda p=mode, e=executor: wall_time(fmus, p, e)
                    for name, mode in modes.items()
                }
            ),
        )
        # two busy threads gain nothing if other programs use all processors
        assert ratios["threads"] < (0.8 if wait else 2)
