"""A system in JSON: what people want to know of its wiring once it has run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..core.system import Connection, Group, Stage, System
from ..engine.transfer_plan import conversion
from .assembly import Assembly


def overview(assembly: Assembly) -> dict[str, Any]:
    """Components, stages (a nested system in them: {"name", "stages"}) and connections of a scenario that is ready to run.

    Of a component: its name, where it comes from, how many scalar inputs and outputs it has, and its period in s (None: every
    macro step). Of a connection: source, target, the source's unit ("" for none) and what happens on the way ("" for nothing).
    """
    system = assembly.system
    return {
        "components": [_component(assembly, name) for name in system.components],
        "stages": _stages(system.stages),
        "connections": [_connection(system, connection) for connection in system.connections],
    }


def _component(assembly: Assembly, name: str) -> dict[str, Any]:
    variables = assembly.system.components[name].variables
    inputs, outputs = (sum(len(v.slots) for v in variables if v.causality == kind) for kind in ("input", "output"))
    period = assembly.system.periods.get(name)
    return {
        "name": name,
        "origin": assembly.origin(name),
        "inputs": inputs,
        "outputs": outputs,
        "period": None if period is None else float(period),
    }


def _stages(stages: Iterable[Stage]) -> list[list[Any]]:
    return [[_member(member) for member in stage] for stage in stages]


def _member(member: str | Group) -> Any:
    return {"name": member.name, "stages": _stages(member.stages)} if isinstance(member, Group) else member


def _connection(system: System, connection: Connection) -> list[str]:
    source, target = system.place(connection.source).variable, system.place(connection.target).variable
    unit = source.unit.name if source.unit else ""
    notes = [f"delay {connection.delay}"] if connection.delay else []
    if source.unit and target.unit and conversion(source, target) != (1.0, 0.0):
        notes.append(f"{source.unit.name} to {target.unit.name}")
    if source.type != target.type:
        notes.append(f"{source.type} to {target.type}")
    return [str(connection.source), str(connection.target), unit, ", ".join(notes)]
