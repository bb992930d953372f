"""Ten million rows from one FMU to a CSV file, and the memory that takes.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_many_rows.py
"""

from __future__ import annotations

import subprocess
import sys

import pytest
from lag import lag_fmu

ROWS = 10_000_000
#: asked for (MB)
LARGEST_PEAK = 300
PROGRAM = """
import resource, sys, time
from fractions import Fraction
from pathlib import Path
from cosim.fmi import FmuFile, instantiate
from cosim.results.csv_files import write_csv
from cosim.simulate import Settings, simulate
from cosim.system import Endpoint, System
steps, step = int(sys.argv[3]) - 1, Fraction(1, 100)
system = System({"a": instantiate(FmuFile(Path(sys.argv[1])), "a")}, (), (("a",),))
run = simulate(system, Settings(Fraction(0), steps * step, step, {"a.y1": Endpoint("a", "y1")}))
began = time.perf_counter()
write_csv(run.recording, sys.argv[2])
print(run.loop_seconds, time.perf_counter() - began, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


def test_ten_million_rows(tmp_path):
    fmu, target = lag_fmu(tmp_path), tmp_path / "result.csv"
    command = [sys.executable, "-c", PROGRAM, fmu, target, str(ROWS)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    loop, writing, peak = map(float, done.stdout.split())
    print(f"\n{ROWS} rows: stepping {loop:.1f} s, CSV {writing:.1f} s ({target.stat().st_size / 1e6:.0f} MB), peak {peak:.0f} MB")
    with target.open() as file:
        assert sum(1 for _ in file) == ROWS + 1
    assert peak < LARGEST_PEAK
