"""Start of a scenario with 1000 FMUs and 10 000 connections: from JSON to the first step.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_large_wiring.py
"""

from __future__ import annotations

import json
import os
from itertools import pairwise, product
from pathlib import Path
from typing import Any

import pytest
from lag_fmus import lag_fmu

import cosim

FMUS, CONNECTIONS = 1000, 10_000
PARTS = (
    "parse_seconds",
    "create_seconds",
    "wiring_seconds",
    "initialize_seconds",
    "loop_seconds",
)
#: required limit (s) for wiring; parsing, extraction and instantiation are only reported
LONGEST_WIRING = 5.0
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


def ring(fmu: Path, size: int, stages: list[list[str]], width: int) -> dict[str, Any]:
    """Return a scenario in which each of `size` instances feeds `width` inputs of the next one by
    single connections.
    """
    names = [f"s{i}" for i in range(size)]
    return {
        "name": "large",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": {name: {"fmu": fmu.name} for name in names},
        "connections": [
            {"from": f"{a}.y{k}", "to": f"{b}.u{k}"}
            for (a, b), k in product(pairwise([*names, names[0]]), range(1, width + 1))
        ],
        "algorithm": {"stages": stages or [names]},
    }


@pytest.mark.parametrize("size", [FMUS, 10], ids=["1000 FMUs", "10 wide FMUs"])
@pytest.mark.parametrize("order", ["one stage", "a stage each"])
def test_wiring(size, order, tmp_path):
    width = CONNECTIONS // size
    stages = [[f"s{i}"] for i in range(size)] if order == "a stage each" else []
    scenario = tmp_path / "large.json"
    scenario.write_text(
        json.dumps(ring(lag_fmu(tmp_path, width=width), size, stages, width), indent=1)
    )
    timing = cosim.run(scenario).timing
    print(
        f"\n{size} FMUs, {CONNECTIONS} connections, {order}, load average {os.getloadavg()[0]:.2f}"
    )
    for part in PARTS:
        print(f"  {part:24}{timing[part]:8.3f} s")
    assert timing["wiring_seconds"] < LONGEST_WIRING
