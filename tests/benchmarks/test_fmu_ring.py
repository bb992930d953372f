"""Ring of N near-empty FMUs, Jacobi: 3 N FMI calls per macro step, whose cost is mostly the
importer's.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_fmu_ring.py
"""

from __future__ import annotations

import pytest
from c_limit import CLimit
from cosim_contender import cpu_per_step, executor_label, executors, ring_system
from cost_measurement import measure_rounds, print_heading, print_rows
from lag_fmus import lag_fmu

SIZES = (2, 8, 32, 128, 1024)
#: macro steps times number of FMUs, per measurement
BUDGETS = {"native": 4_000_000, "python": 100_000}
#: largest allowed ratio to the C limit (generous)
LARGEST_RATIO = {"C limit": 2, "cosim, native": 20, "cosim, python": 2000}
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("recorded", ["one signal", "all signals"])
@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_ring(version, recorded, tmp_path):
    fmu = lag_fmu(tmp_path, version)
    limit = CLimit(fmu, tmp_path)
    choices = executors()
    print_heading(f"ring of FMI {version}.0 FMUs, {recorded} recorded")
    for size in SIZES:
        names = [f"s{i}.y1" for i in range(1 if recorded == "one signal" else size)]
        contenders = {
            "C limit": lambda size=size, names=names: limit(
                size, BUDGETS["native"] // size, recorded=len(names)
            )
        }
        for executor in choices:
            steps = max(200, BUDGETS[executor] // size)
            contenders[executor_label(executor)] = lambda s=size, n=steps, r=names, e=executor: (
                cpu_per_step(ring_system(fmu, s), n, r, e)
            )
        ratios = print_rows(f"ring {size}", measure_rounds(contenders))
        assert all(ratio < LARGEST_RATIO[name] for name, ratio in ratios.items())
