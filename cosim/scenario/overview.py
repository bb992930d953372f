"""Description of a system as JSON for `run.json` and the report: components, stages and connections."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..core.system import Connection, Group, Stage, System
from ..engine.transfer_plan import unit_conversion
from .prepared_run import PreparedRun


def describe_system(prepared: PreparedRun) -> dict[str, Any]:
    """Return the components, stages and connections of a prepared run as JSON values.

    - `components`: {"name", "origin", "inputs", "outputs", "period"}: the source in the scenario, the numbers of scalar inputs
      and outputs, and the period (s; None: every macro step)
    - `stages`: lists of component names; a nested system is {"name", "stages"}
    - `connections`: [source, target, unit of the source or "", notes on delay and conversion or ""]
    """
    system = prepared.system
    return {
        "components": [_describe_component(prepared, name) for name in system.components],
        "stages": _describe_stages(system.stages),
        "connections": [_describe_connection(system, connection) for connection in system.connections],
    }


def _describe_component(prepared: PreparedRun, name: str) -> dict[str, Any]:
    variables = prepared.system.components[name].variables
    inputs, outputs = (sum(len(v.scalar_names) for v in variables if v.causality == kind) for kind in ("input", "output"))
    period = prepared.system.periods.get(name)
    return {
        "name": name,
        "origin": prepared.component_source(name),
        "inputs": inputs,
        "outputs": outputs,
        "period": None if period is None else float(period),
    }


def _describe_stages(stages: Iterable[Stage]) -> list[list[Any]]:
    return [[_describe_member(member) for member in stage] for stage in stages]


def _describe_member(member: str | Group) -> Any:
    return {"name": member.name, "stages": _describe_stages(member.stages)} if isinstance(member, Group) else member


def _describe_connection(system: System, connection: Connection) -> list[str]:
    source, target = system.find_element(connection.source).variable, system.find_element(connection.target).variable
    unit = source.unit.name if source.unit else ""
    notes = [f"delay {connection.delay}"] if connection.delay else []
    if source.unit and target.unit and unit_conversion(source, target) != (1.0, 0.0):
        notes.append(f"{source.unit.name} to {target.unit.name}")
    if source.type != target.type:
        notes.append(f"{source.type} to {target.type}")
    return [str(connection.source), str(connection.target), unit, ", ".join(notes)]
