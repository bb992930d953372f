"""Ten million rows of one FMU to CSV and Parquet files: duration and memory.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_many_rows.py
"""

from __future__ import annotations

import subprocess
import sys

import pytest
from lag_fmus import lag_fmu

ROWS = 10_000_000
#: required limit of memory (MB)
LARGEST_PEAK = 300
PROGRAM = """
import resource, sys, time
from fractions import Fraction
from pathlib import Path
from cosim.components.fmi import FmuFile, create_component
from cosim.results.csv_files import write_csv
from cosim.results.parquet_files import write_parquet
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.core.system import Endpoint, System
steps, step = int(sys.argv[2]) - 1, Fraction(1, 100)
outputs = {f"a.y{k}": Endpoint("a", f"y{k}") for k in range(1, int(sys.argv[3]) + 1)}
system = System({"a": create_component(FmuFile(Path(sys.argv[1])), "a")}, (), (("a",),))
run = simulate(system, Settings(Fraction(0), steps * step, step, outputs))
print(run.timing["loop_seconds"])
for name, write in (("csv", write_csv), ("parquet", write_parquet)):
    start = time.perf_counter()
    write(run.recording, f"result.{name}")
    print(time.perf_counter() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
"""
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


@pytest.mark.parametrize("signals", [1, 5])
def test_ten_million_rows(signals, tmp_path):
    fmu = lag_fmu(tmp_path, width=signals)
    command = [sys.executable, "-c", PROGRAM, fmu, str(ROWS), str(signals)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
    loop, csv, csv_peak, parquet, parquet_peak = map(float, done.stdout.split())
    print(f"\n{ROWS} rows of {signals} signals: stepping {loop:.1f} s")
    for name, seconds, peak in (("csv", csv, csv_peak), ("parquet", parquet, parquet_peak)):
        size = (tmp_path / f"result.{name}").stat().st_size / 1e6
        print(f"  {name:8} {seconds:5.1f} s, {size:5.0f} MB, peak {peak:4.0f} MB")
        assert peak < LARGEST_PEAK
    with (tmp_path / "result.csv").open() as file:
        assert sum(1 for _ in file) == ROWS + 1
