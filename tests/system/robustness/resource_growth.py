"""Growth of a process over many runs, or over the steps of one run: `python resource_growth.py
SCENARIO runs|steps COUNT`.

Prints JSON: growth of the resident memory (bytes), and of open descriptors, threads, child
processes and temporary files, from the end of a warm-up on (the first runs, or a tenth of the
steps).
"""

from __future__ import annotations

import gc
import json
import os
import sys
import tempfile
from fractions import Fraction
from pathlib import Path

import cosim

NO_OUTPUTS = {
    "/record": {"signals": []},
    "/stop_when": [],
    "/kpis": [],
    "/checks": [],
    "/figures": [],
}


def resource_usage() -> dict[str, int]:
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return {
        "memory": pages * os.sysconf("SC_PAGE_SIZE"),
        "descriptors": entries("/proc/self/fd"),
        "threads": entries("/proc/self/task"),
        "children": len(Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()),
        "temporaries": entries(tempfile.gettempdir()),
    }


def entries(folder: str) -> int:
    return sum(1 for _ in Path(folder).iterdir())


def measure_runs(scenario: str, count: int) -> list[dict[str, int]]:
    """After the first runs, in which caches and memory pools fill, and after many more."""
    looks, first = [], max(10, min(50, count))
    for n in range(1, first + count + 1):
        cosim.run(scenario, NO_OUTPUTS | {"/record": {"signals": ["*"]}}, stop_time=0.05)
        if n in (first, first + count):
            looks.append(resource_usage())
    return looks


def measure_steps(scenario: str, count: int) -> list[dict[str, int]]:
    """After a tenth of the steps, and after all of them."""
    looks = []

    def look(finished: int, steps: int) -> None:
        if finished in (steps // 10, steps):
            looks.append(resource_usage())

    cosim.run(scenario, NO_OUTPUTS, stop_time=str(Fraction(count, 100)), observers=[look])
    return looks


if __name__ == "__main__":
    before, after = {"runs": measure_runs, "steps": measure_steps}[sys.argv[2]](
        sys.argv[1], int(sys.argv[3])
    )
    print(json.dumps({what: after[what] - before[what] for what in before}))
