"""One FMU for 100 000 steps, and FMUs with a thousand inputs and outputs.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_one_fmu.py
"""

from __future__ import annotations

import pytest
from c_limit import CLimit
from cosim_contender import cpu_per_step, executor_label, executors, ring_system, single_fmu_system
from cost_measurement import measure_rounds, print_heading, print_rows
from lag_fmus import lag_fmu

STEPS = 100_000
WIDTH = 1000
#: largest allowed ratio to the C limit (generous)
LARGEST_RATIO = 500
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_one_fmu(version, tmp_path):
    fmu = lag_fmu(tmp_path, version)
    limit = CLimit(fmu, tmp_path)
    contenders = {"C limit": lambda: limit(1, STEPS, ring=False)}
    for executor in executors():
        contenders[executor_label(executor)] = lambda e=executor: cpu_per_step(
            single_fmu_system(fmu), STEPS, ["s0.y1"], e
        )
    print_heading(f"one FMI {version}.0 FMU, {STEPS} steps, one signal recorded")
    assert max(print_rows("one FMU", measure_rounds(contenders)).values()) < LARGEST_RATIO


def test_wide_fmus(tmp_path):
    fmu = lag_fmu(tmp_path, width=WIDTH)
    limit = CLimit(fmu, tmp_path)
    print_heading(
        f"ring of 2 FMUs, {WIDTH} connections from each to the other, one signal recorded"
    )
    contenders = {"C limit": lambda: limit(2, 20_000, width=WIDTH)}
    for executor in executors():
        contenders[executor_label(executor)] = lambda e=executor: cpu_per_step(
            ring_system(fmu, 2), 5_000, ["s0.y1"], e
        )
    assert (
        max(print_rows(f"{WIDTH} inputs, outputs", measure_rounds(contenders)).values())
        < LARGEST_RATIO
    )
