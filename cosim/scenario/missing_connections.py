"""Inputs that nothing feeds or sets, although they probably lack a connection."""

from __future__ import annotations

import difflib
from collections.abc import Iterator

from ..core.compatibility import incompatibility
from ..core.component import Component, Variable
from ..core.errors import abbreviate_names
from ..core.system import Endpoint, System
from .fitting_outputs import MissingConnection, OutputFinder, Place, VariablesByEndpoint
from .nested_systems import Node
from .system_builder import PROFILE_PREFIX

#: number of inputs, and of outputs that fit them, that a warning names
_MAX_NAMES = 4


def find_missing_connections(
    root: Node, system: System, unconnected: VariablesByEndpoint
) -> Iterator[tuple[str, str]]:
    """Yield (component, text) for each connection that is probably missing, and for components with other inputs that lack one.

    The component of a connection to ports is the nested system. A pair ("", text) names components of which no input is fed.

    An input probably lacks a connection if an output has its name, if outputs feed other elements of its vector, or if it is a
    single number and half of the component's inputs or more (vectors count once) are fed or set. Vectors of which no element is
    fed are often disturbances, a vertical component ("force.z") beside horizontal ones that are fed is often 0 on purpose, and
    Booleans are requests that nothing makes.

    Args:
        root: The scenario.
        system: Its system.
        unconnected: Scalar inputs that no connection, start value or event sets, with their variables.
    """
    if not unconnected:
        return
    finder, fed_vectors, isolated = OutputFinder(root, system), _fed_vectors(system), []
    explained: set[Endpoint] = set()
    for missing in finder.missing_connections(unconnected):
        explained.update(end for ends in missing.inputs.values() for end in ends)
        yield next(iter(missing.inputs)).member_name, _missing_text(missing)
    for name, component in system.components.items():
        inputs = _input_slots(name, component)
        unfed = {end: unconnected[end] for end in inputs if end in unconnected}
        suspects = [end for end in _suspects(inputs, unfed, fed_vectors) if end not in explained]
        if unfed and len(unfed) == len(inputs) and explained.isdisjoint(unfed):
            isolated.append(name)
        elif suspects:
            hint = _hint(finder, len(suspects), finder.place_of(suspects[0]), unfed[suspects[0]])
            yield (
                name,
                f"nothing feeds or sets {abbreviate_names(map(str, suspects), _MAX_NAMES)}{hint}",
            )
    if isolated and system.connections:
        yield (
            "",
            f"nothing feeds or sets an input of {', '.join(isolated)}: are connections missing?",
        )


def _missing_text(missing: MissingConnection) -> str:
    *others, last = (
        missing.sources
        if len(missing.sources) <= _MAX_NAMES
        else [abbreviate_names(missing.sources, _MAX_NAMES)]
    )
    sources = f"{', '.join(others)} or {last}" if others else last
    names = abbreviate_names(map(str, missing.inputs), _MAX_NAMES)
    return (
        f"nothing feeds or sets {names}: is a connection from {sources} to {missing.target} "
        "missing?"
    )


def _input_slots(name: str, component: Component) -> list[Endpoint]:
    return [
        Endpoint(name, slot)
        for v in component.variables
        if v.causality == "input"
        for slot in v.scalar_names
    ]


def _fed_vectors(system: System) -> set[Endpoint]:
    """Return the vectors of inputs that outputs of other components feed, as a whole or in part."""
    prefix = f"{PROFILE_PREFIX}."
    ends = (c.target for c in system.connections if not c.source.component.startswith(prefix))
    return {Endpoint(end.component, vector) for end in ends if (vector := _vector(end.scalar))}


def _suspects(
    inputs: list[Endpoint], unfed: VariablesByEndpoint, fed_vectors: set[Endpoint]
) -> list[Endpoint]:
    """Return the unfed inputs of a component that probably lack a connection, whatever the names of outputs are."""
    groups, unfed_groups = (
        {_vector(end.scalar) or end.scalar for end in ends} for ends in (inputs, unfed)
    )
    is_mostly_fed = 2 * len(groups - unfed_groups) >= len(groups)
    return [
        end
        for end, variable in unfed.items()
        if (
            Endpoint(end.component, vector := _vector(end.scalar)) in fed_vectors
            and not end.scalar.endswith(".z")
        )
        or (is_mostly_fed and not vector and variable.type != "Boolean")
    ]


def _vector(slot: str) -> str:
    """Return the name of the vector that a scalar belongs to, with its separator.

    "motor[" of "motor[1]"; "" if there is none.
    """
    return slot[: max(slot.rfind("."), slot.rfind("[")) + 1]


def _hint(finder: OutputFinder, count: int, place: Place, variable: Variable) -> str:
    """Return the end of a warning about a number of inputs.

    The output with the name nearest to that of the first input.
    """
    keep = "they keep their start values" if count > 1 else "it keeps its start value"
    similar = _similar_output(finder, place, variable)
    nearest = f"; the output nearest by name is {similar}" if similar else ""
    return (
        f': {keep} until a connection feeds or "parameters" set '
        f"{'them' if count > 1 else 'it'}{nearest}"
    )


def _similar_output(finder: OutputFinder, place: Place, variable: Variable) -> Place | None:
    """Return the output of another component with the most similar name, of those of the same quantity."""
    outputs = {
        output.scalar: output
        for output, other in finder.outputs_beside(place)
        if not incompatibility(other, variable)
    }
    near = difflib.get_close_matches(place.scalar, outputs, n=1)
    return outputs[near[0]] if near else None
