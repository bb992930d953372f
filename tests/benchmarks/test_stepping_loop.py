"""Where the time of a macro step goes. Run with: pytest -m benchmark -n 0 -s tests/benchmarks"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from statistics import median
from time import perf_counter
from typing import Any

import pytest

import cosim
from cosim.component import Component
from cosim.scenario import Assembly
from cosim.simulate import Run, simulate

REPEATS = 7
pytestmark = pytest.mark.benchmark


class Timed:
    """A component that adds up the time spent in it."""

    def __init__(self, component: Component):
        self._component, self.seconds = component, 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._component, name)

    def set_inputs(self) -> None:
        self._clocked(self._component.set_inputs)

    def do_step(self, time: float, step_size: float) -> Any:
        return self._clocked(self._component.do_step, time, step_size)

    def get_outputs(self) -> None:
        self._clocked(self._component.get_outputs)

    def _clocked(self, call: Any, *arguments: Any) -> Any:
        began = perf_counter()
        result = call(*arguments)
        self.seconds += perf_counter() - began
        return result


def flown(assembly: Assembly, **changes: Any) -> Run:
    run = simulate(replace(assembly.system, **changes.pop("system", {})), replace(assembly.settings, **changes))
    if run.failure:
        raise run.failure
    return run


def microseconds(run: Run) -> float:
    return run.loop_seconds / run.macro_steps * 1e6


def shares(name: str) -> Iterator[tuple[str, float]]:
    """(part, microseconds per macro step), one instrumented run and one without recording beside it."""
    assembly = cosim.load(name)
    timed = {key: Timed(component) for key, component in assembly.system.components.items()}
    whole = microseconds(flown(assembly, system={"components": timed}))
    without = microseconds(flown(cosim.load(name), columns={}))
    plain = microseconds(flown(cosim.load(name)))
    scale = plain / whole
    plants = {key for key in timed if key in ("plant", "quadcopter", "vessel")}
    per_step = 1e6 / assembly.settings.stop_time * assembly.settings.step_size
    spent = {key: float(component.seconds * per_step) * scale for key, component in timed.items()}
    yield "plant", sum(spent[key] for key in plants)
    yield "controllers", sum(spent[key] for key in spent if key not in plants)
    yield "recording", max(0.0, plain - without)
    yield "importer", plain - sum(spent.values()) - max(0.0, plain - without)


@pytest.mark.parametrize("name", ["demo1_box", "free_flight"])
def test_stepping_loop(name: str) -> None:
    loops = [microseconds(flown(cosim.load(name))) for _ in range(REPEATS)]
    parts = [dict(shares(name)) for _ in range(REPEATS)]
    step = float(cosim.load(name).settings.step_size) * 1e6
    best, middle = min(loops), median(loops)
    print(f"\n{name}: load average {os.getloadavg()[0]:.2f}, {REPEATS} runs")
    print(f"  best   {best:7.1f} us per macro step  {step / best:6.0f} x real time")
    print(f"  median {middle:7.1f} us per macro step  {step / middle:6.0f} x real time")
    for part in parts[0]:
        print(f"  {part:12} {median(p[part] for p in parts):7.1f} us")
    assert best > 0
