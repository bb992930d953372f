"""Candidate controller of a benchmark.

Its source, its interface, and the check of the interface against a role.
"""

import json
import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

from ...core.component import Component, Variable
from ...core.errors import InputError, Problem, did_you_mean, nearest_file
from ...core.time_grid import fraction_text
from ...scenario import load
from ...scenario.component_sources import component_kinds
from ...scenario.name_resolution import SlotIndex, Target, UnknownNameError, resolve_name
from ...scenario.nested_systems import Node, load_scenario
from ...scenario.schema import NestedSpec
from .role import Role

_CANDIDATE = "candidate"
_CAUSALITIES = {
    "inputs": ("input",),
    "outputs": ("output",),
    "parameters": ("parameter", "structuralParameter"),
}


@dataclass(frozen=True)
class CandidateSource:
    """Source of a candidate.

    Attributes:
        entry: its component in a scenario, such as {"fmu": "/abs/my.fmu"}.
        name: its name, such as "my".
        text: the argument of the command, such as "my.fmu".
    """

    entry: Mapping[str, str]
    name: str
    text: str


def parse_source(text: str) -> CandidateSource:
    """Parse `my.fmu`, `my.py:Class`, `my.mo:Model` or a nested system `my.json`.

    Raises:
        InputError: if the text has another form or the file does not exist.
    """
    file, separator, member = text.partition(":")
    path = Path(file)
    kinds = component_kinds().values()
    kind = next((each for each in kinds if path.suffix == each.SUFFIX), None)
    if kind is None or bool(separator) != bool(kind.MEMBER):
        raise InputError(
            f'expected my.fmu, my.py:Class, my.mo:Model or a nested system my.json, found "{text}"'
        )
    if not path.is_file():
        raise InputError(f'there is no file "{file}"{nearest_file(path)}')
    return CandidateSource(
        {kind.KEY: f"{path.resolve()}{separator}{member}"}, member or path.stem, text
    )


@dataclass(frozen=True)
class CandidateInterface:
    """Variables of a candidate by the names of their scalars.

    Attributes:
        inputs: input variables.
        outputs: output variables.
        parameters: parameters, also structural ones.
        inner_variables: variables of a nested system's own components, which scenarios may set and
            record, too.
    """

    inputs: Mapping[str, Variable]
    outputs: Mapping[str, Variable]
    parameters: Mapping[str, Variable]
    inner_variables: frozenset[str] = frozenset()

    @property
    def names(self) -> set[str]:
        """Names of all variables."""
        return {*self.inputs, *self.outputs, *self.parameters, *self.inner_variables}

    def has_variables(self, name: str) -> bool:
        """Return whether `name` stands for variables.

        It may be a variable, an array, a prefix, or a pattern with "*".
        """
        head, star, tail = name.partition("*")
        if star:
            return any(each.startswith(head) and each.endswith(tail) for each in self.names)
        return not name or any(
            each == name or each.startswith((f"{name}.", f"{name}[")) for each in self.names
        )


def read_interface(candidate: CandidateSource) -> CandidateInterface:
    """Load the candidate alone and return its variables.

    Raises:
        InputError: if it cannot be loaded, with the problems of a scenario that contains it.
    """
    scenario = {
        "name": _CANDIDATE,
        "stop_time": 1,
        "step_size": 1,
        "components": {_CANDIDATE: dict(candidate.entry)},
    }
    with TemporaryDirectory(prefix="cosim-") as folder:
        file = Path(folder) / f"{_CANDIDATE}.json"
        file.write_text(json.dumps(scenario), encoding="utf-8")
        try:
            prepared = load(file, {"/step_size": _common_step(file)})
        except InputError as error:
            # the user knows no temporary scenario
            problems = [
                replace(each, where=candidate.text) if each.where.startswith(str(file)) else each
                for each in error.problems
            ]
            raise InputError(problems) from None
    try:
        root, components = prepared.root, prepared.system.components
        return (
            _system_interface(root, components)
            if _CANDIDATE in root.children
            else _component_interface(components[_CANDIDATE])
        )
    finally:
        prepared.free()


def _common_step(file: Path) -> str:
    """Return the largest step size (s) that divides 1 s and the periods of all components."""
    periods = [Fraction(1)]
    for node in load_scenario(file).root.walk():
        periods += [spec.period for spec in node.spec.components.values() if spec.period]
    denominator = math.lcm(*(period.denominator for period in periods))
    return fraction_text(
        Fraction(math.gcd(*(int(period * denominator) for period in periods)), denominator)
    )


def _component_interface(component: Component) -> CandidateInterface:
    inputs, outputs, parameters = (
        scalars(component, causalities) for causalities in _CAUSALITIES.values()
    )
    return CandidateInterface(inputs, outputs, parameters)


def scalars(component: Component, causalities: Collection[str] = ()) -> dict[str, Variable]:
    """Return the variables of a component by the names of their scalars; no causalities: all."""
    found: dict[str, Variable] = {}
    for variable in component.variables:
        if not causalities or variable.causality in causalities:
            found |= dict.fromkeys(variable.scalar_names, variable)
    return found


def _system_interface(root: Node, components: Mapping[str, Component]) -> CandidateInterface:
    inner: set[str] = set()
    for name, component in components.items():
        inside = name.removeprefix(f"{_CANDIDATE}.")
        inner |= {f"{inside}.{slot}" for slot in scalars(component)}
    inputs, outputs, parameters = (
        dict(_port_variables(root, components, kind)) for kind in _CAUSALITIES
    )
    return CandidateInterface(inputs, outputs, parameters, frozenset(inner))


def _port_variables(
    root: Node, components: Mapping[str, Component], kind: str
) -> Iterator[tuple[str, Variable]]:
    """Yield the variables behind the ports of one kind by their names outside the nested system."""
    nested = cast(NestedSpec, root.children[_CANDIDATE].spec)
    for port in getattr(nested.ports, kind):
        for target in _port_targets(root, port, kind):
            component = components[target.component]
            variables = scalars(component)
            for causality in _CAUSALITIES[kind]:
                for rest, slot in SlotIndex(component, causality).below(target.prefix).items():
                    yield port + rest, variables[slot]


def _port_targets(root: Node, port: str, kind: str) -> list[Target]:
    try:
        return resolve_name(root, f"{_CANDIDATE}.{port}", (kind,))
    except UnknownNameError as error:
        raise InputError(str(error)) from None


def interface_problems(
    role: Role, interface: CandidateInterface, settings: Iterable[str] = ()
) -> list[Problem]:
    """Return all problems for which a controller cannot take a role.

    Args:
        role: the role.
        interface: the controller's interface.
        settings: names of the variables that are set.
    """
    short = {short: role.parameters[name] for name, short in role.short_names.items()}
    expected = {**short, **role.inputs, **role.outputs, **role.parameters}
    texts = [
        _missing_output(name, role, interface)
        for name in role.outputs
        if name not in interface.outputs
    ]
    unused = [name for name in role.inputs if name not in interface.inputs]
    for name in interface.inputs:
        if name not in role.inputs:
            hint = did_you_mean(name, unused)
            texts.append(f'the role has no signal for the input "{name}"{hint}')
    for variables in (interface.inputs, interface.outputs, interface.parameters):
        for name, variable in variables.items():
            unit = expected.get(name) or role.parameters.get(name.partition("[")[0])
            if unit and variable.unit and not variable.unit.converts_to(unit):
                texts.append(
                    f'"{name}" has the unit "{variable.unit.name}", expected "{unit.name}" or a '
                    "unit that converts to it"
                )
    for name in settings:
        if not interface.has_variables(name):
            hint = did_you_mean(name, interface.names - interface.outputs.keys())
            texts.append(f'the controller has no variable "{name}"{hint}')
    return [Problem(text) for text in texts]


def _missing_output(name: str, role: Role, interface: CandidateInterface) -> str:
    unit = role.outputs[name]
    expected = f'the output "{name}"' + (f" ({unit.name})" if unit else "")
    if name in {*interface.inputs, *interface.parameters}:
        causality = "an input" if name in interface.inputs else "a parameter"
        return f'"{name}" is {causality}, expected an output'
    others = [output for output in interface.outputs if output not in role.outputs]
    return f"{expected} is missing{did_you_mean(name, others)}"
