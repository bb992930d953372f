"""One FMU alone for 100 000 steps, and FMUs with a thousand inputs and outputs.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_one_fmu.py
"""

from __future__ import annotations

import pytest
from importer import alone, cost, executors, label, ring
from lag import lag_fmu
from limit import Limit
from measure import compare, heading, show

STEPS = 100_000
WIDTH = 1000
#: generous: times the C limit
LARGEST_RATIO = 500
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("version", [2, 3], ids=["fmi2", "fmi3"])
def test_one_fmu(version, tmp_path):
    fmu = lag_fmu(tmp_path, version)
    limit = Limit(fmu, tmp_path)
    contenders = {"C limit": lambda: limit(1, STEPS, ring=False)}
    for executor in executors():
        contenders[label(executor)] = lambda e=executor: cost(alone(fmu), STEPS, ["s0.y1"], e)
    heading(f"one FMI {version}.0 FMU, {STEPS} steps, one signal recorded")
    assert max(show("one FMU", compare(contenders)).values()) < LARGEST_RATIO


def test_wide_fmus(tmp_path):
    fmu = lag_fmu(tmp_path, width=WIDTH)
    limit = Limit(fmu, tmp_path)
    heading(f"ring of 2 FMUs, {WIDTH} connections from each to the other, one signal recorded")
    contenders = {"C limit": lambda: limit(2, 20_000, width=WIDTH)}
    for executor in executors():
        contenders[label(executor)] = lambda e=executor: cost(ring(fmu, 2), 5_000, ["s0.y1"], e)
    assert max(show(f"{WIDTH} inputs, outputs", compare(contenders)).values()) < LARGEST_RATIO
