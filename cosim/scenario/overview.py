"""Description of a run as JSON for `run.json` and the report.

Components, stages, connections and software.
"""

import platform
from collections.abc import Iterable, Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from types import MappingProxyType
from typing import Any

from ..core import __version__
from ..core.component import scalars_of
from ..core.system import Connection, Group, Stage, System
from ..engine.transfer_plan import unit_conversion
from ..results import RunMetadata

#: packages whose versions can change a result
_PACKAGES = ("numpy", "scipy", "fmpy", "pybullet", "pybullet-arm64", "pythonfmu")


def describe_system(
    system: System,
    sources: Mapping[str, str],
    solvers: Mapping[str, Mapping[str, Any]] = MappingProxyType({}),
) -> dict[str, Any]:
    """Return the components, stages and connections of a system as JSON values.

    - `components`: {"name", "origin", "inputs", "outputs", "period", "solver"}: the source in the
      scenario, the numbers of scalar inputs and outputs, the period (s; None: every macro step),
      and the solver of a Model Exchange FMU (else no such key)
    - `stages`: lists of component names; a nested system is {"name", "stages"}
    - `connections`: [source, target, unit of the source or "", notes on delay and conversion or ""]

    Args:
        system: The system.
        sources: Source of each component.
        solvers: Solver of each Model Exchange FMU, by name of the component.
    """
    components: list[dict[str, Any]] = []
    for name, component in system.components.items():
        period = system.periods.get(name)
        entry = {
            "name": name,
            "origin": sources[name],
            "inputs": len(scalars_of(component.variables, "input")),
            "outputs": len(scalars_of(component.variables, "output")),
            "period": None if period is None else float(period),
        }
        components.append(entry | ({"solver": solvers[name]} if name in solvers else {}))
    connections: list[list[str]] = []
    for each in system.connections:
        unit = system.find_element(each.source).variable.unit
        ends = [str(each.source), str(each.target)]
        connections.append([*ends, unit.name if unit else "", connection_notes(system, each)])
    stages = _describe_stages(system.stages)
    return {"components": components, "stages": stages, "connections": connections}


def describe_software() -> RunMetadata:
    """Return the versions of cosim, Python and `_PACKAGES`, and the kind of machine."""
    return {
        "versions": dict(_versions()),
        "machine": {"system": platform.system(), "machine": platform.machine()},
    }


@cache
def _versions() -> dict[str, str]:
    versions = {"cosim": __version__, "python": platform.python_version()}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return versions


def _describe_stages(stages: Iterable[Stage]) -> list[list[Any]]:
    return [list(map(_describe_member, stage)) for stage in stages]


def _describe_member(member: str | Group) -> Any:
    return (
        {"name": member.name, "stages": _describe_stages(member.stages)}
        if isinstance(member, Group)
        else member
    )


def connection_notes(system: System, connection: Connection) -> str:
    """Return the delay and all conversions of a connection as text, such as "delay 1, deg to rad".

    "" for a plain copy.
    """
    ends = (connection.source, connection.target)
    source, target = (system.find_element(end).variable for end in ends)
    notes = [f"delay {connection.delay}"] if connection.delay else []
    notes += [connection.interpolation] if connection.interpolation != "hold" else []
    if source.unit and target.unit and unit_conversion(source, target) != (1.0, 0.0):
        notes.append(f"{source.unit.name} to {target.unit.name}")
    elif source.unit and not target.unit and source.unit.exponents and any(source.unit.exponents):
        notes.append(f"{source.unit.name}, the input has no unit")
    if source.type != target.type:
        notes.append(f"{source.type} to {target.type}")
    if connection.is_mapped:
        notes += [f"term {connection.term} of a sum"] if connection.term else []
        notes += (
            [f"gain {connection.gain:g}"] if connection.gain != 1.0 or not connection.term else []
        )
        notes += [f"offset {connection.offset:g}"] if connection.offset else []
    return ", ".join(notes)
