"""Where the time of a macro step goes. Run with: pytest -m benchmark -n 0 -s tests/benchmarks"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from statistics import median
from time import perf_counter
from typing import Any

import pytest

import cosim
from cosim.component import Call, Component
from cosim.simulate import Run, simulate

REPEATS = 7
#: simulated microseconds per macro step of the scenarios below
STEP = 10_000.0
PLANTS = ("plant", "quadcopter", "vessel")
pytestmark = pytest.mark.benchmark


class Timed:
    """A component that adds up the time spent in it; its clock costs about 0.1 us per call, which is counted in."""

    def __init__(self, component: Component):
        self._component, self.seconds = component, 0.0

    def __getattr__(self, name: str) -> Any:
        return getattr(self._component, name)

    def turn(self, clock: Any, step_size: float) -> Sequence[Call] | None:
        calls = self._component.turn(clock, step_size)
        return calls and [Call(self._clocked(call.function), call.arguments, call.name) for call in calls]

    def set_inputs(self) -> None:
        self._clocked(self._component.set_inputs)()

    def do_step(self, time: float, step_size: float) -> Any:
        return self._clocked(self._component.do_step)(time, step_size)

    def get_outputs(self) -> None:
        self._clocked(self._component.get_outputs)()

    def _clocked(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def clocked(*arguments: Any) -> Any:
            began = perf_counter()
            result = call(*arguments)
            self.seconds += perf_counter() - began
            return result

        return clocked


def flown(name: str, timed: dict[str, Timed] | None = None, **changes: Any) -> float:
    """Microseconds per macro step of one flight."""
    assembly = cosim.load(name)
    system = assembly.system
    if timed is not None:
        timed.update({key: Timed(component) for key, component in system.components.items()})
        system = replace(system, components=timed)
    run: Run = simulate(system, replace(assembly.settings, **changes))
    if run.failure:
        raise run.failure
    return run.loop_seconds / run.macro_steps * 1e6


def shares(name: str) -> dict[str, float]:
    """One flight as it is, one with clocks in it and one without recording, right after each other: parts in microseconds."""
    timed: dict[str, Timed] = {}
    plain, clocked, silent = flown(name), flown(name, timed), flown(name, columns={})
    steps = 4000
    spent = {key: component.seconds / steps * 1e6 for key, component in timed.items()}
    plant = sum(spent[key] for key in spent if key in PLANTS)
    controllers = sum(spent.values()) - plant
    recording = max(0.0, plain - silent)
    return {
        "whole": plain,
        "plant": plant,
        "controllers": controllers,
        "recording": recording,
        "importer": max(0.0, plain - plant - controllers - recording),
        "clocks": clocked - plain,
    }


@pytest.mark.parametrize("name", ["demo1_box", "free_flight"])
def test_stepping_loop(name: str) -> None:
    flights = [shares(name) for _ in range(REPEATS)]
    loops = [flight.pop("whole") for flight in flights]
    print(f"\n{name}: load average {os.getloadavg()[0]:.2f}, {REPEATS} flights of 40 s")
    for label, loop in (("best", min(loops)), ("median", median(loops))):
        print(f"  {label:12} {loop:7.1f} us per macro step  {STEP / loop:6.0f} x real time")
    for part in flights[0]:
        print(f"  {part:12} {median(flight[part] for flight in flights):7.1f} us")
