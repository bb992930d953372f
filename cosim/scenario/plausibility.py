"""What is probably a mistake in a scenario that can run all the same."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..core.component import Variable
from ..core.errors import Problem
from ..core.paths import is_file
from ..core.system import Endpoint, System, incompatibility

if TYPE_CHECKING:
    from .prepared_run import PreparedRun

VariablesByEndpoint = dict[Endpoint, Variable]


def find_warnings(assembly: PreparedRun) -> list[Problem]:
    """All of them, each with its place in the file."""
    return [*missing_connections(assembly), *_missing_reference(assembly), *_late_events(assembly)]


def missing_connections(assembly: PreparedRun) -> Iterator[Problem]:
    """At most one problem: inputs that nothing feeds or sets, while other components have outputs of their names."""
    system, free = assembly.system, unconnected_inputs(assembly)
    outputs = _outputs_by_name(system) if free else {}
    found = {end: source for end, variable in free.items() if (source := _matching_output(end, variable, outputs, system))}
    if found:
        (end, source), more = next(iter(found.items())), len(found) - 1
        others = f" and {more} more input{'s' * (more > 1)}" if more else ""
        shown = next((port for port, inner in system.aliases.items() if inner == source), source)
        text = f"nothing feeds or sets {end}{others}, but there is an output {shown}: is a connection missing?"
        yield Problem(text, assembly.root.where("connections"))


def unconnected_inputs(assembly: PreparedRun) -> VariablesByEndpoint:
    """Inputs that keep their own start values for the whole run."""
    system = assembly.system
    given = {connection.target for connection in system.connections}
    changes = [system.start_values, *(event.values for event in assembly.settings.events)]
    given_names = {(component, name) for values in changes for component, own in values.items() for name in own}
    return {
        end: variable
        for name, component in system.components.items()
        for variable in component.variables
        if variable.causality == "input" and (name, variable.name) not in given_names
        for slot in variable.scalar_names
        if (end := Endpoint(name, slot)) not in given
    }


def _outputs_by_name(system: System) -> dict[str, VariablesByEndpoint]:
    """All outputs, by each of the names that an input may know them by; those that nothing reads come first."""
    read = {connection.source for connection in system.connections}
    ends = {
        Endpoint(name, slot): variable
        for name, component in system.components.items()
        for variable in component.variables
        if variable.causality == "output"
        for slot in variable.scalar_names
    }
    known: dict[str, VariablesByEndpoint] = {}
    for end in sorted(ends, key=read.__contains__):
        for name in _lookup_names(end.scalar):
            known.setdefault(name, {})[end] = ends[end]
    return known


def _matching_output(
    end: Endpoint, variable: Variable, outputs: dict[str, VariablesByEndpoint], system: System
) -> Endpoint | None:
    """An output of another component that has the name of an input and could feed it."""
    for name in _lookup_names(end.scalar):
        for source, other in outputs.get(name, {}).items():
            whole = name in (end.scalar, source.scalar) or "." in name
            if whole and source.component != end.component and not incompatibility(other, variable):
                return source
    return None


def _lookup_names(slot: str) -> list[str]:
    """A variable's name as it is and without the vehicle in front: "uav.position.x" and "position.x"."""
    rest = slot.partition(".")[2]
    return [slot, rest] if rest else [slot]


def _missing_reference(assembly: PreparedRun) -> Iterator[Problem]:
    reference = assembly.spec.reference
    if reference and not is_file(assembly.root.folder / reference.file):
        text = f'file "{reference.file}" does not exist: `cosim regress --update` writes it'
        yield Problem(text, assembly.root.where("reference", "file"))


def _late_events(assembly: PreparedRun) -> Iterator[Problem]:
    stop = assembly.settings.stop_time
    for event in assembly.settings.events:
        if event.time > stop:
            text = f"this event does not happen: {float(event.time):g} s is after the stop time {float(stop):g} s"
            yield Problem(text, event.where)
