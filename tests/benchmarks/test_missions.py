"""Flights: Demo 1 against the bare PyBullet calls of the same mission, flight on FMUs alone, several pairs of vehicles.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_missions.py
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from bullet_calls import record_calls
from cosim_contender import executor_label, executors
from cost_measurement import Stopwatch, measure_rounds, print_heading, print_rows

import cosim
from cosim.engine import ExecutorKind
from cosim.engine.run_loop import simulate

SCENARIOS = Path(__file__).parents[2] / "scenarios"
#: generous: times PyBullet's own calls
LARGEST_RATIO = 6
#: between pairs of vehicles (m); far enough for no contact
DISTANCE = 100.0
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


def flown(scenario: str | Path, executor: ExecutorKind, **changes: Any) -> float:
    """CPU microseconds per macro step of the stepping loop of one flight."""
    assembly = cosim.load(scenario)
    watch = Stopwatch()
    run = simulate(assembly.system, replace(assembly.settings, executor=executor, **changes), [watch])
    if run.failure:
        raise run.failure
    return watch.cpu


def flights(scenario: str | Path) -> dict[str, Callable[[], float]]:
    """The contenders of a mission: every executor, and the first of them without recording."""
    contenders = {executor_label(executor): lambda e=executor: flown(scenario, e) for executor in executors()}
    return contenders | {"cosim, nothing recorded": lambda: flown(scenario, executors()[0], columns={})}


def test_demo1_against_the_bare_calls_of_pybullet(monkeypatch):
    """The floor is Bullet taking part in every step; the second row holds the calls that are still made."""
    made = record_calls(lambda: cosim.load("demo1_box"))
    (clearance,) = (module for name, module in sys.modules.items() if name.endswith(".plant_src.clearance"))
    monkeypatch.setattr(clearance, "NEAR_DISTANCE", 1e9)
    everywhere = record_calls(lambda: cosim.load("demo1_box"))
    monkeypatch.undo()
    print_heading("demo1_box, 40 s")
    floors = {"PyBullet in every step": everywhere.replay, "PyBullet's calls made": made.replay}
    ratios = print_rows("demo1_box", measure_rounds({**floors, **flights("demo1_box")}))
    assert max(ratios.values()) < LARGEST_RATIO


def test_free_flight():
    print_heading("free_flight, 40 s on FMUs alone")
    ratios = print_rows("free_flight", measure_rounds(flights("free_flight")))
    assert ratios["cosim, nothing recorded"] < 2


def test_pairs_of_vehicles(tmp_path):
    print_heading("pairs of quadcopter and vessel in one world, 40 s")
    for pairs in (1, 2, 4):
        scenario = tmp_path / f"pairs{pairs}.json"
        scenario.write_text(json.dumps(with_pairs(pairs)))
        calls = record_calls(lambda scenario=scenario: cosim.load(scenario))
        contenders = {"PyBullet's calls alone": calls.replay}
        contenders |= {executor_label(executor): lambda s=scenario, e=executor: flown(s, e) for executor in executors()}
        assert max(print_rows(f"pairs: {pairs}", measure_rounds(contenders)).values()) < LARGEST_RATIO


def with_pairs(count: int) -> dict[str, Any]:
    """Demo 1 with `count` pairs side by side, each on its own box."""
    text = (SCENARIOS / "demo1_box.json").read_text()
    demo = json.loads(text.replace('"../', f'"{SCENARIOS.parent}/').replace('"systems/', f'"{SCENARIOS}/systems/'))
    plant, uav, usv = (demo["components"][name] for name in ("plant", "uav", "usv"))
    vehicles, platforms = plant["arguments"]["vehicles"], plant["arguments"]["platforms"]
    components: dict[str, Any] = {"plant": plant}
    connections: list[Any] = []
    plant["arguments"] |= {"vehicles": {}, "platforms": {}}
    for i in range(count):
        east = i * DISTANCE
        plant["arguments"]["vehicles"] |= {f"{name}{i}": _moved(spec, east) for name, spec in vehicles.items()}
        plant["arguments"]["platforms"] |= {f"{name}{i}": _moved(spec, east) for name, spec in platforms.items()}
        waypoints = [x + east for x in usv["parameters"]["waypoint_x"]]
        components[f"uav{i}"] = uav
        components[f"usv{i}"] = usv | {"parameters": usv["parameters"] | {"waypoint_x": waypoints}}
        connections += [{end: _renamed(name, i) for end, name in connection.items()} for connection in demo["connections"]]
    stages = [[name for name in components if name != "plant"], ["plant"]]
    times = {key: demo[key] for key in ("start_time", "stop_time", "step_size")}
    algorithm = {"kind": "staged", "stages": stages}
    return {"name": "pairs", **times, "components": components, "connections": connections, "algorithm": algorithm}


def _moved(spec: dict[str, Any], east: float) -> dict[str, Any]:
    x, *others = spec["position"]
    return spec | {"position": [x + east, *others]}


def _renamed(endpoint: str, i: int) -> str:
    return endpoint.replace("uav", f"uav{i}").replace("usv", f"usv{i}")
