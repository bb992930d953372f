"""A system: components, the connections between their variables, and the order in which they step.

Pure data, checked as a whole: `System.problems` finds everything that is wrong with the wiring in one go.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from .component import Component, Variable
from .errors import Problem, did_you_mean

INTEGER_TYPES = frozenset({"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"})
FLOAT_TYPES = frozenset({"Float64", "Float32"})


class Endpoint(NamedTuple):
    """One scalar variable (or array element) of one component."""

    component: str
    scalar: str

    def __str__(self) -> str:
        return f"{self.component}.{self.scalar}"


@dataclass(frozen=True, slots=True)
class Connection:
    """The value of an output goes to an input, `delay` macro steps late; `where` says who asked for it."""

    source: Endpoint
    target: Endpoint
    delay: int = 0
    where: str = ""


#: whether the components of a stage step at the same time, on threads: where it pays, always, or never
Parallel = Literal["auto", True, False]


@dataclass(frozen=True, slots=True)
class Iteration:
    """Stages are repeated from the same state until no connected output among them changes any more.

    A number y has stopped changing when it differs from its last value by at most tolerance * (1 + |y|). It is an error when
    that takes more than `limit` rounds.
    """

    tolerance: float
    max_rounds: int


@dataclass(frozen=True, slots=True)
class Group:
    """Components that step in stages of their own inside one place of an outer stage (a nested system)."""

    name: str
    stages: tuple[Stage, ...]
    parallel: Parallel = "auto"
    iteration: Iteration | None = None


Stage = tuple["str | Group", ...]


def component_names(stages: Iterable[Stage]) -> Iterator[str]:
    """Names of all components in the stages, groups opened."""
    for stage in stages:
        for member in stage:
            if isinstance(member, Group):
                yield from component_names(member.stages)
            else:
                yield member


def iterate_groups(stages: Iterable[Stage]) -> Iterator[Group]:
    """All groups in the stages, also those inside groups."""
    for member in (member for stage in stages for member in stage):
        if isinstance(member, Group):
            yield member
            yield from iterate_groups(member.stages)


class VariableElement(NamedTuple):
    """The variable a slot belongs to, and the element's index in it (row-major)."""

    variable: Variable
    element: int


@dataclass(frozen=True)
class System:
    """What is simulated. Stages step one after the other; the components of a stage step side by side.

    `start_values` holds parameters and start values by component and variable name; `periods` the components that step
    less often than every macro step (s); `aliases` further names under which outputs are recorded. `parallel`: whether the
    components of a stage step at the same time, with the same result.
    """

    components: Mapping[str, Component]
    connections: Sequence[Connection] = ()
    stages: Sequence[Stage] = ()
    periods: Mapping[str, Fraction] = field(default_factory=dict)
    start_values: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    aliases: Mapping[str, Endpoint] = field(default_factory=dict)
    parallel: Parallel = "auto"

    @cached_property
    def slots(self) -> Mapping[str, Mapping[str, VariableElement]]:
        """Every slot of every component, by component and slot name."""
        return {
            name: {
                slot: VariableElement(variable, i)
                for variable in component.variables
                for i, slot in enumerate(variable.scalar_names)
            }
            for name, component in self.components.items()
        }

    def find_element(self, endpoint: Endpoint) -> VariableElement:
        return self.slots[endpoint.component][endpoint.scalar]

    def problems(self) -> list[Problem]:
        """Everything that is wrong with connections and stages; empty when the system can run."""
        return [*self._find_stage_problems(), *self._find_connection_problems()]

    def _find_stage_problems(self) -> Iterator[Problem]:
        seen: set[str] = set()
        subject = ("algorithm", "stages")
        for name in component_names(self.stages):
            if name not in self.components:
                yield Problem(f'unknown component "{name}"{did_you_mean(name, self.components)}', subject=subject)
            elif name in seen:
                yield Problem(f'component "{name}" stands in the stages twice', subject=subject)
            seen.add(name)
        for group in iterate_groups(self.stages):
            if group.iteration:
                yield from self._find_iteration_problems(group)
        for name in self.components:
            if name not in seen:
                yield Problem(f'component "{name}" is in no stage, so it would never step', subject=subject)

    def _find_iteration_problems(self, group: Group) -> Iterator[Problem]:
        repeated = f"the stages of {group.name} are iterated"
        for name in component_names(group.stages):
            if name in self.components and not self.components[name].has_state:
                text = f'{repeated}, but "{name}" cannot return to a state (FMI: canGetAndSetFMUState)'
                yield Problem(text, subject=("components", name))
            if name in self.periods:
                yield Problem(f'{repeated}, so "{name}" cannot have a period of its own', subject=("components", name, "period"))

    def _find_connection_problems(self) -> Iterator[Problem]:
        fed: dict[Endpoint, Connection] = {}
        for connection in self.connections:
            source = self._find_endpoint_problem(connection.source, "output")
            target = self._find_endpoint_problem(connection.target, "input")
            if source or target:
                yield from (Problem(text, connection.where) for text in (source, target) if text)
                continue
            if connection.target in fed:
                first = fed[connection.target].source
                yield Problem(f"input {connection.target} is connected twice: it is already fed by {first}", connection.where)
            fed.setdefault(connection.target, connection)
            if text := incompatibility(
                self.find_element(connection.source).variable, self.find_element(connection.target).variable
            ):
                yield Problem(f"{connection.source} cannot feed {connection.target}: {text}", connection.where)

    def _find_endpoint_problem(self, end: Endpoint, causality: str) -> str:
        if end.component not in self.components:
            return f'unknown component "{end.component}"{did_you_mean(end.component, self.components)}'
        slots = self.slots[end.component]
        if end.scalar not in slots:
            valid = (name for name, place in slots.items() if place.variable.causality == causality)
            return f'component "{end.component}" has no variable "{end.scalar}"{did_you_mean(end.scalar, valid)}'
        if (found := slots[end.scalar].variable.causality) != causality:
            return f"{end} is of causality {found}, expected an {causality}"
        return ""


def incompatibility(source: Variable, target: Variable) -> str:
    """Why a value of `source` cannot become one of `target`; "" when it can, if necessary with conversion."""
    if not _is_convertible(source, target):
        return f"type {source.type} does not become {target.type}"
    if source.unit and target.unit and not source.unit.converts_to(target.unit):
        return f'units "{source.unit.name}" and "{target.unit.name}" measure different quantities'
    return ""


def _is_convertible(source: Variable, target: Variable) -> bool:
    if source.type == target.type:
        return source.type != "Clock"
    if target.type in FLOAT_TYPES:
        exact = source.type in INTEGER_TYPES and source.dtype.itemsize < target.dtype.itemsize
        return source.type in FLOAT_TYPES or source.type == "Enumeration" or exact
    if source.type == "Enumeration":  # its values are small, whatever their type
        return target.type in ("Int32", "Int64")
    if target.type == "Enumeration":
        return source.type in INTEGER_TYPES - {"UInt64"}
    return {source.type, target.type} <= INTEGER_TYPES and bool(np.can_cast(source.dtype, target.dtype, "safe"))
