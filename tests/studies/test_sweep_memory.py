"""Memory of a sweep, which must not grow with the number of runs."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from lag_project import descendants

from cosim.studies.execution.job import Record
from cosim.studies.execution.run_store import RunStore
from cosim.studies.sweep import Sweep

pytestmark = [pytest.mark.long, pytest.mark.timeout(1800)]
RUNS, LAST = 100_000, 100


def proportional_kilobytes(processes):
    """Return the memory (kB) of processes; pages shared by several count once."""
    total = 0
    for process in processes:
        try:
            lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
        except OSError:  # the process has just ended
            continue
        total += sum(int(line.split()[1]) for line in lines if line.startswith("Pss:"))
    return total


def test_100_000_runs_take_less_than_300_megabytes(lag):
    """Only the last 100 runs are made; records of the others exist and are as long as real ones."""
    half = {"range": {"min": 1.0, "max": 2.0, "count": RUNS // 2}}
    sweep = lag.write(
        factors=[
            {"name": "y", "set": "lag.y_start", **half},
            {"name": "T", "set": "lag.T", "values": [0.5, 1.0]},
        ]
    )
    folder = lag.folder / "runs/sweep"
    folder.mkdir(parents=True)
    with RunStore(folder) as run_store:
        for number, job in enumerate(Sweep.from_file(sweep).jobs()):
            if number < RUNS - LAST:
                run_store.add(Record(job.key, {"end.value": 0.8 + 1e-6 * number}, seconds=0.0123))
    process = lag.start_command("sweep", sweep, "--workers", 2)
    peak = 0
    while process.poll() is None:
        peak = max(peak, proportional_kilobytes([process.pid, *descendants(process.pid)]))
        time.sleep(0.5)
    out, err = process.communicate()
    assert process.returncode == 0, err
    assert f"{RUNS} of {RUNS} runs, {LAST} made now" in out
    print(f"\n{peak / 1000:.0f} MB at most")
    assert 0 < peak < 300_000
    assert len(list(folder.iterdir())) == 8
