"""Inputs that nothing feeds or sets, although they probably lack a connection."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping

from ..core.component import Component, Variable
from ..core.errors import abbreviate_names
from ..core.system import Endpoint, System, incompatibility
from .system_builder import PROFILE_PREFIX

VariablesByEndpoint = dict[Endpoint, Variable]

#: number of inputs that a warning names
_MAX_NAMES = 4


def find_missing_connections(system: System, unconnected: VariablesByEndpoint) -> Iterator[tuple[str, str]]:
    """Yield (component, text) for each component with inputs that probably lack a connection.

    One pair ("", text) names the components of which no input is fed.

    An input probably lacks a connection if an output has its name, if outputs feed other elements of its vector, or if it is a
    single number and half of the component's inputs or more (vectors count once) are fed or set. Vectors of which no element is
    fed are often disturbances, a vertical component ("force.z") beside horizontal ones that are fed is often 0 on purpose, and
    Booleans are requests that nothing makes.

    Args:
        system: The system.
        unconnected: Scalar inputs that no connection, start value or event sets, with their variables.
    """
    if not unconnected:
        return
    outputs, fed_vectors, isolated = _outputs_by_name(system), _fed_vectors(system), []
    for name, component in system.components.items():
        inputs = _input_slots(name, component)
        unfed = {end: unconnected[end] for end in inputs if end in unconnected}
        sources = {end: source for end, variable in unfed.items() if (source := _matching_output(end, variable, outputs))}
        is_isolated = bool(unfed) and len(unfed) == len(inputs)
        suspects = _suspects(inputs, unfed, sources, fed_vectors)
        if is_isolated and not sources:
            isolated.append(name)
        elif suspects:
            yield (
                name,
                f"nothing feeds or sets {abbreviate_names(map(str, suspects), _MAX_NAMES)}{_hint(system, suspects, sources)}",
            )
    if isolated and system.connections:
        yield "", f"nothing feeds or sets an input of {', '.join(isolated)}: are connections missing?"


def _input_slots(name: str, component: Component) -> list[Endpoint]:
    return [Endpoint(name, slot) for v in component.variables if v.causality == "input" for slot in v.scalar_names]


def _fed_vectors(system: System) -> set[Endpoint]:
    """Return the vectors of inputs that outputs of other components feed, as a whole or in part."""
    prefix = f"{PROFILE_PREFIX}."
    ends = (c.target for c in system.connections if not c.source.component.startswith(prefix))
    return {Endpoint(end.component, vector) for end in ends if (vector := _vector(end.scalar))}


def _suspects(
    inputs: list[Endpoint], unfed: VariablesByEndpoint, sources: Mapping[Endpoint, Endpoint], fed_vectors: set[Endpoint]
) -> VariablesByEndpoint:
    """Return the unfed inputs of a component that probably lack a connection; those with a matching output come first."""
    groups, unfed_groups = ({_vector(end.scalar) or end.scalar for end in ends} for ends in (inputs, unfed))
    is_mostly_fed = 2 * len(groups - unfed_groups) >= len(groups)
    others = [
        end
        for end, variable in unfed.items()
        if (Endpoint(end.component, vector := _vector(end.scalar)) in fed_vectors and not end.scalar.endswith(".z"))
        or (is_mostly_fed and not vector and variable.type != "Boolean")
    ]
    return {end: unfed[end] for end in (*sources, *others)}


def _vector(slot: str) -> str:
    """Return the name of the vector that a scalar belongs to, with its separator: "motor[" of "motor[1]"; "" if there is none."""
    return slot[: max(slot.rfind("."), slot.rfind("[")) + 1]


def _hint(system: System, suspects: VariablesByEndpoint, sources: Mapping[Endpoint, Endpoint]) -> str:
    """Return the end of a warning: an output that can be connected to the first input, by equal or by similar name."""
    end, variable = next(iter(suspects.items()))
    if end in sources:
        return f", but there is an output {_shown(system, sources[end])}: is a connection missing?"
    keep = "they keep their start values" if len(suspects) > 1 else "it keeps its start value"
    similar = _similar_output(system, end, variable)
    nearest = f"; the output nearest by name is {_shown(system, similar)}" if similar else ""
    return f': {keep} until a connection feeds or "parameters" set {"them" if len(suspects) > 1 else "it"}{nearest}'


def _shown(system: System, source: Endpoint) -> str | Endpoint:
    """Return the port of a nested system that publishes an output, else the output."""
    return next((port for port, inner in system.aliases.items() if inner == source), source)


def _outputs_by_name(system: System) -> dict[str, VariablesByEndpoint]:
    """Return all scalar outputs by the names that a matching input may have; unconnected outputs come first."""
    connected = {connection.source for connection in system.connections}
    ends = _outputs(system)
    outputs: dict[str, VariablesByEndpoint] = {}
    for end in sorted(ends, key=connected.__contains__):
        for name in _lookup_names(end.scalar):
            outputs.setdefault(name, {})[end] = ends[end]
    return outputs


def _outputs(system: System) -> VariablesByEndpoint:
    return {
        Endpoint(name, slot): variable
        for name, component in system.components.items()
        for variable in component.variables
        if variable.causality == "output"
        for slot in variable.scalar_names
    }


def _matching_output(end: Endpoint, variable: Variable, outputs: dict[str, VariablesByEndpoint]) -> Endpoint | None:
    """Return an output of another component that has the name of an input and can be connected to it."""
    for name in _lookup_names(end.scalar):
        for source, other in outputs.get(name, {}).items():
            is_specific = name in (end.scalar, source.scalar) or "." in name
            if is_specific and source.component != end.component and not incompatibility(other, variable):
                return source
    return None


def _similar_output(system: System, end: Endpoint, variable: Variable) -> Endpoint | None:
    """Return the output of another component with the most similar name, of those of the same quantity."""
    sources = {
        source.scalar: source
        for source, other in _outputs(system).items()
        if source.component != end.component and not incompatibility(other, variable)
    }
    near = difflib.get_close_matches(end.scalar, sources, n=1)
    return sources[near[0]] if near else None


def _lookup_names(slot: str) -> list[str]:
    """Return the names of a scalar with and without the name of the vehicle: "uav.position.x" and "position.x"."""
    rest = slot.partition(".")[2]
    return [slot, rest] if rest else [slot]
