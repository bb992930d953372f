"""The controller that is put to the test, and whether it fits into its place."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

from ...core.component import Component, Variable
from ...core.errors import InputError, Problem, did_you_mean
from ...scenario import prepare
from ...scenario.name_resolution import SlotIndex, Target, UnknownNameError, resolve_name
from ...scenario.nested_systems import Node, load_scenario
from ...scenario.schema import NestedSpec
from .role import Role

_CANDIDATE = "candidate"
_SOURCE_KINDS = {".fmu": "fmu", ".py": "python", ".mo": "modelica", ".json": "system"}
_CAUSALITIES = {"inputs": ("input",), "outputs": ("output",), "parameters": ("parameter", "structuralParameter")}


@dataclass(frozen=True)
class CandidateSource:
    """Where a candidate comes from: its entry in a scenario ({"fmu": "/abs/my.fmu"}), its name ("my"), and the user's text."""

    entry: Mapping[str, str]
    name: str
    text: str


def parse_source(text: str) -> CandidateSource:
    """`my.fmu`, `my.py:Class`, `my.mo:Model` or a nested system `my.json`. Raises InputError."""
    file, separator, member = text.partition(":")
    path = Path(file)
    kind = _SOURCE_KINDS.get(path.suffix)
    if kind is None or bool(separator) != (kind in ("python", "modelica")):
        raise InputError(f'expected my.fmu, my.py:Class, my.mo:Model or a nested system my.json, found "{text}"')
    if not path.is_file():
        raise InputError(f'there is no file "{file}"')
    return CandidateSource({kind: f"{path.resolve()}{separator}{member}"}, member or path.stem, text)


@dataclass(frozen=True)
class CandidateInterface:
    """The variables of a candidate as its place sees them, by the names of their slots; `inner` are those of a nested system's
    own components, which scenarios may set and record too."""

    inputs: Mapping[str, Variable]
    outputs: Mapping[str, Variable]
    parameters: Mapping[str, Variable]
    inner_variables: frozenset[str] = frozenset()

    @property
    def names(self) -> set[str]:
        return {*self.inputs, *self.outputs, *self.parameters, *self.inner_variables}

    def has_variables(self, name: str) -> bool:
        """Whether `name` is a variable, an array or a prefix of variables."""
        return not name or any(own == name or own.startswith((f"{name}.", f"{name}[")) for own in self.names)


def read_interface(candidate: CandidateSource) -> CandidateInterface:
    """Load the candidate alone and look at its variables. Raises InputError as a scenario with it would."""
    scenario = {"name": _CANDIDATE, "stop_time": 1, "step_size": 1, "components": {_CANDIDATE: dict(candidate.entry)}}
    with TemporaryDirectory(prefix="cosim-") as folder:
        file = Path(folder) / f"{_CANDIDATE}.json"
        file.write_text(json.dumps(scenario), encoding="utf-8")
        try:
            assembly = prepare(file, {"/step_size": _common_step(file)})
        except InputError as error:
            raise InputError([_with_user_location(problem, file, candidate) for problem in error.problems]) from None
    try:
        root, components = assembly.root, assembly.system.components
        return (
            _system_interface(root, components) if _CANDIDATE in root.children else _component_interface(components[_CANDIDATE])
        )
    finally:
        assembly.free()


def _with_user_location(problem: Problem, file: Path, candidate: CandidateSource) -> Problem:
    """A problem whose place the user knows: not `file`, which is made up."""
    return replace(problem, where=candidate.text) if problem.where.startswith(str(file)) else problem


def _common_step(file: Path) -> str:
    """A step size that divides 1 s and the periods of all components."""
    specs = (spec for node in load_scenario(file).root.walk() for spec in node.spec.components.values())
    periods = [Fraction(1), *(spec.period for spec in specs if spec.period)]
    denominator = math.lcm(*(period.denominator for period in periods))
    return str(Fraction(math.gcd(*(int(period * denominator) for period in periods)), denominator))


def _component_interface(component: Component) -> CandidateInterface:
    inputs, outputs, parameters = (
        {slot: v for v in component.variables if v.causality in causalities for slot in v.scalar_names}
        for causalities in _CAUSALITIES.values()
    )
    return CandidateInterface(inputs, outputs, parameters)


def _system_interface(root: Node, components: Mapping[str, Component]) -> CandidateInterface:
    inner = {
        f"{name.removeprefix(_CANDIDATE + '.')}.{slot}"
        for name, c in components.items()
        for v in c.variables
        for slot in v.scalar_names
    }
    inputs, outputs, parameters = (dict(_port_variables(root, components, kind)) for kind in _CAUSALITIES)
    return CandidateInterface(inputs, outputs, parameters, frozenset(inner))


def _port_variables(root: Node, components: Mapping[str, Component], kind: str) -> Iterator[tuple[str, Variable]]:
    """The variables behind the ports of one kind, by the names that they have outside."""
    nested = cast(NestedSpec, root.children[_CANDIDATE].spec)
    for port in getattr(nested.ports, kind):
        for target in _port_targets(root, port, kind):
            component = components[target.component]
            variables = {slot: v for v in component.variables for slot in v.scalar_names}
            for causality in _CAUSALITIES[kind]:
                for rest, slot in SlotIndex(component, causality).below(target.prefix).items():
                    yield port + rest, variables[slot]


def _port_targets(root: Node, port: str, kind: str) -> list[Target]:
    try:
        return resolve_name(root, f"{_CANDIDATE}.{port}", (kind,))
    except UnknownNameError as error:
        raise InputError(str(error)) from None


def interface_problems(role: Role, found: CandidateInterface, settings: Iterable[str] = ()) -> list[Problem]:
    """Why a controller with this interface cannot take the role with these variables set, all at once."""
    expected = {**role.inputs, **role.outputs, **role.parameters}
    return [
        *(_missing_output(name, role, found) for name in role.outputs if name not in found.outputs),
        *(_unexpected_input(name, role, found) for name in found.inputs if name not in role.inputs),
        *(
            Problem(f'"{name}" has the unit "{variable.unit.name}", expected "{unit.name}" or what converts to it')
            for variables in (found.inputs, found.outputs, found.parameters)
            for name, variable in variables.items()
            if (unit := expected.get(name) or role.parameters.get(name.partition("[")[0]))
            and variable.unit
            and not variable.unit.converts_to(unit)
        ),
        *(Problem(f'it has no variable "{name}"{_name_hint(name, found)}') for name in settings if not found.has_variables(name)),
    ]


def _name_hint(name: str, found: CandidateInterface) -> str:
    return did_you_mean(name, {*found.parameters, *found.inner_variables, *found.inputs})


def _missing_output(name: str, role: Role, found: CandidateInterface) -> Problem:
    unit = role.outputs[name]
    wanted = f'the output "{name}"' + (f" ({unit.name})" if unit else "")
    if name in {*found.inputs, *found.parameters}:
        causality = "an input" if name in found.inputs else "a parameter"
        return Problem(f'"{name}" is {causality}, expected an output')
    others = [own for own in found.outputs if own not in role.outputs]
    return Problem(f"{wanted} is missing{did_you_mean(name, others)}")


def _unexpected_input(name: str, role: Role, found: CandidateInterface) -> Problem:
    free = [own for own in role.inputs if own not in found.inputs]
    return Problem(f'nothing feeds the input "{name}" in this role{did_you_mean(name, free)}')
