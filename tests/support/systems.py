"""Helpers that build and run small systems from short texts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

from cosim.core.component import Component
from cosim.core.recording import Recording
from cosim.core.system import Connection, Endpoint, Stage, System
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Event, Settings


def endpoint(name: str) -> Endpoint:
    """Return the endpoint of a name such as "a.y": component before the last dot, then scalar."""
    component, _, scalar = name.rpartition(".")
    return Endpoint(component, scalar)


def make_system(
    components: Mapping[str, Component], wires: str = "", stages: Sequence[Stage] = (), **more: Any
) -> System:
    """Return a system with connections such as "a.y > b.u, b.y >2 a.u" (delay 2); default: all
    components in one stage.
    """
    connections = []
    for wire in filter(None, (part.strip() for part in wires.split(","))):
        source, arrow, target = wire.split()
        connections.append(Connection(endpoint(source), endpoint(target), int(arrow[1:] or 0)))
    return System(components, connections, tuple(stages) or (tuple(components),), **more)


def run_system(
    system: System,
    stop: float | str,
    step: float | str = "1/100",
    record: Sequence[str] = (),
    events: Sequence[Event] = (),
) -> Recording:
    """Simulate from 0 s and return the recording; a failure is raised."""
    columns = {name: endpoint(name) for name in record}
    outcome = simulate(
        system,
        Settings(Fraction(0), exact_fraction(stop), exact_fraction(step), columns, events=events),
    )
    if outcome.failure:
        raise outcome.failure
    return outcome.recording


def connection(source: str, target: str, **more: Any) -> dict[str, Any]:
    """Return a connection in the form of a scenario file."""
    return {"from": source, "to": target, **more}
