"""Missions: Demo 1 compared with its PyBullet calls, a flight of FMUs only, several pairs of
vehicles.

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

from cosim.engine import ExecutorKind
from cosim.engine.plan_run import simulate
from cosim.scenario import load

SCENARIOS = Path(__file__).parents[2] / "scenarios"
#: largest allowed ratio to the PyBullet calls (generous)
LARGEST_RATIO = 6
#: distance between pairs of vehicles (m), large enough to exclude contact
DISTANCE = 100.0
pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]


def step_cost(scenario: str | Path, executor: ExecutorKind, **changes: Any) -> float:
    """Return the CPU time (us) per macro step of the stepping loop of one run."""
    prepared = load(scenario)
    watch = Stopwatch()
    run = simulate(
        prepared.system, replace(prepared.plan.settings, executor=executor, **changes), [watch]
    )
    if run.failure:
        raise run.failure
    return watch.cpu


def contenders_of(scenario: str | Path) -> dict[str, Callable[[], float]]:
    """Return the contenders of a mission: every executor, and the first one without recording."""
    contenders = {
        executor_label(executor): lambda e=executor: step_cost(scenario, e)
        for executor in executors()
    }
    return contenders | {
        "cosim, nothing recorded": lambda: step_cost(
            scenario, executors()[0], columns={}, stop_conditions=()
        )
    }


def test_demo1_compared_with_its_pybullet_calls(monkeypatch):
    """The reference steps Bullet in every step; the second row contains only the calls that the
    plant makes.
    """
    actual = record_calls(lambda: load("demo1_box"))
    (clearance,) = (
        module
        for name, module in sys.modules.items()
        if name.endswith("plant_src.physics.clearance")
    )
    monkeypatch.setattr(clearance, "NEAR_DISTANCE", 1e9)
    in_every_step = record_calls(lambda: load("demo1_box"))
    monkeypatch.undo()
    print_heading("demo1_box, 40 s")
    references = {
        "PyBullet in every step": in_every_step.replay,
        "actual PyBullet calls": actual.replay,
    }
    ratios = print_rows("demo1_box", measure_rounds({**references, **contenders_of("demo1_box")}))
    assert max(ratios.values()) < LARGEST_RATIO


def test_free_flight():
    print_heading("free_flight, 40 s, FMUs only")
    ratios = print_rows("free_flight", measure_rounds(contenders_of("free_flight")))
    assert ratios["cosim, nothing recorded"] < 2


def test_pairs_of_vehicles(tmp_path):
    print_heading("pairs of quadcopter and vessel in one world, 40 s")
    for pairs in (1, 2, 4):
        scenario = tmp_path / f"pairs{pairs}.json"
        scenario.write_text(json.dumps(with_pairs(pairs)))
        calls = record_calls(lambda scenario=scenario: load(scenario))
        contenders = {"PyBullet calls only": calls.replay}
        contenders |= {
            executor_label(executor): lambda s=scenario, e=executor: step_cost(s, e)
            for executor in executors()
        }
        assert (
            max(print_rows(f"pairs: {pairs}", measure_rounds(contenders)).values()) < LARGEST_RATIO
        )


def with_pairs(count: int) -> dict[str, Any]:
    """Return Demo 1 with `count` pairs of vehicles, each with its own box."""
    text = (SCENARIOS / "demo1_box.json").read_text()
    demo = json.loads(
        text.replace('"../', f'"{SCENARIOS.parent}/').replace('"systems/', f'"{SCENARIOS}/systems/')
    )
    plant, uav, usv = (demo["components"][name] for name in ("plant", "uav", "usv"))
    vehicles, platforms = plant["arguments"]["vehicles"], plant["arguments"]["platforms"]
    components: dict[str, Any] = {"plant": plant}
    connections: list[Any] = []
    plant["arguments"] |= {"vehicles": {}, "platforms": {}}
    for i in range(count):
        east = i * DISTANCE
        plant["arguments"]["vehicles"] |= {
            f"{name}{i}": _moved(spec, east) for name, spec in vehicles.items()
        }
        plant["arguments"]["platforms"] |= {
            f"{name}{i}": _moved(spec, east) for name, spec in platforms.items()
        }
        waypoints = [x + east for x in usv["parameters"]["waypoint_x"]]
        components[f"uav{i}"] = uav
        components[f"usv{i}"] = usv | {"parameters": usv["parameters"] | {"waypoint_x": waypoints}}
        for connection in demo["connections"]:
            connections.append({end: _renamed(name, i) for end, name in connection.items()})
    stages = [[name for name in components if name != "plant"], ["plant"]]
    times = {key: demo[key] for key in ("start_time", "stop_time", "step_size")}
    algorithm = {"kind": "staged", "stages": stages}
    return {
        "name": "pairs",
        **times,
        "components": components,
        "connections": connections,
        "algorithm": algorithm,
    }


def _moved(spec: dict[str, Any], east: float) -> dict[str, Any]:
    x, *others = spec["position"]
    return spec | {"position": [x + east, *others]}


def _renamed(endpoint: str, i: int) -> str:
    return endpoint.replace("uav", f"uav{i}").replace("usv", f"usv{i}")
