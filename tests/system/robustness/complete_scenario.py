"""A scenario that uses every key of the format once, and the files it needs."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

BLOCKS = Path(__file__).parents[2] / "scenario" / "pythonfmu_blocks.py"
KPIS = """
def last(result, signal):
    return {"value": float(result[signal][-1])}


def nothing(result):
    return {}


def picture(result):
    from matplotlib.figure import Figure

    return Figure()
"""
#: every key of the format is used once
INNER_SYSTEM: dict[str, Any] = {
    "components": {
        "g": {"python": "pythonfmu_blocks.py:Gain", "period": 1},
        "h": {"python": "pythonfmu_blocks.py:Gain"},
    },
    "connections": [{"from": "g.y", "to": "h.u", "delay": 1}],
    "algorithm": {"kind": "staged", "stages": [["g"], ["h"]]},
    "ports": {"inputs": {"x": ["g.u"]}, "outputs": {"y": "h.y"}, "parameters": {"factor": "g.k"}},
}
SCENARIO: dict[str, Any] = {
    "name": "good",
    "description": "Everything at once.",
    "start_time": 0,
    "stop_time": 4.0,
    "step_size": "1/2",
    "components": {
        "a": {"python": "pythonfmu_blocks.py:Gain", "parameters": {"k": 3.0}, "period": 1},
        "b": {"python": "pythonfmu_blocks.py:Plant", "arguments": {"vehicle": "ship"}},
        "c": {"python": "pythonfmu_blocks.py:Controller", "parameters": {"gain": [1.0, 2.0]}},
        "t": {
            "python": "pythonfmu_blocks.py:Typed",
            "parameters": {"number": 3, "flag": True, "text": "x"},
        },
        "inner": {"system": "inner.json", "parameters": {"factor": 2.0}},
        "f": {"fmu": "probe.fmu", "parameters": {"y_start": 1.0}},
    },
    "connections": [
        {"from": "a.y", "to": "inner.x"},
        {"from": "b.ship", "to": "c.vehicle", "delay": 1},
        {"from": "c.motor", "to": "b.ship.motor"},
        {"from": "inner.y", "to": "f.u"},
    ],
    "algorithm": {
        "kind": "staged",
        "stages": [["a", "inner"], ["b", "c", "t"], ["f"]],
        "parallel": "auto",
    },
    "record": {"signals": ["*.y", "b.*"], "interval": 1},
    "events": [{"time": 1, "set": {"a.k": 2.0}}],
    "inputs": [{"file": "profile.csv", "to": {"x": ["a.u"]}, "interpolation": "linear"}],
    "kpis": [{"name": "end", "python": "kpis.py:last", "arguments": {"signal": "a.y"}}],
    "checks": [{"kpi": "end.value", "max": 10, "min": -10}],
    "figures": [{"name": "picture", "python": "kpis.py:picture"}],
    "reference": {"file": "profile.csv", "tolerances": {"a.*": {"absolute": 0.1, "time": 0.1}}},
    "deadlines": {"load": 10.0, "step": 5.0},
    "non_finite": "error",
}


def write_scenario_files(folder: Path, probe: Path) -> Path:
    """The folder with the files that the scenario names; the scenario itself is not in it."""
    shutil.copy(BLOCKS, folder)
    shutil.copy(probe, folder / "probe.fmu")
    (folder / "kpis.py").write_text(KPIS)
    (folder / "profile.csv").write_text("time,x\n0,1\n4,2\n")
    return folder
