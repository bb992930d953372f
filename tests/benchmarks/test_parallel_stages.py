"""Two FMUs in one stage, 1 ms per step each: one after the other, and at the same time.

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
from cosim.engine.run_loop import simulate
from cosim.engine.settings import Settings

LONG, STEPS = 1e-3, 200
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


def wall(fmus, parallel: Parallel, executor) -> float:
    """Wall microseconds per macro step."""
    components = {f"c{i}": create_component(FmuFile(fmu), f"c{i}") for i, fmu in enumerate(fmus)}
    built = System(components, (), (tuple(components),), parallel=parallel)
    run = simulate(built, Settings(Fraction(0), Fraction(STEPS, 100), Fraction(1, 100), executor=executor))
    assert run.failure is None
    return run.loop_seconds / STEPS * 1e6


@pytest.mark.parametrize("wait", [False, True], ids=["busy", "waiting"])
def test_two_long_fmus(wait, tmp_path):
    fmus = [slow_fmu(tmp_path, name, LONG, wait) for name in ("a", "b")]
    for executor in executors():
        print_heading(f"two FMUs in one stage, 1 ms each, {'waiting' if wait else 'busy'}; {executor}", "wall us per step")
        ways: dict[str, Parallel] = {"one thread": False, "threads": "auto"}
        ratios = print_rows(
            "1 ms", measure_rounds({name: lambda w=way, e=executor: wall(fmus, w, e) for name, way in ways.items()})
        )
        # two busy threads gain nothing where other programs keep all processors busy
        assert ratios["threads"] < (0.8 if wait else 2)
