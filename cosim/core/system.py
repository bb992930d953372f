"""Components, connections between variables that can be converted, and the order of steps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import chain
from typing import Any, Literal, NamedTuple

import numpy as np

from .component import Component, Variable
from .errors import Problem, did_you_mean
from .text import count_noun


class Endpoint(NamedTuple):
    """One scalar variable (or array element) of one component."""

    component: str
    scalar: str

    def __str__(self) -> str:
        return f"{self.component}.{self.scalar}"


#: course of an input within a step
Interpolation = Literal["hold", "linear"]


@dataclass(frozen=True, slots=True)
class Connection:
    """Connection of an output to an input.

    Attributes:
        source: The output.
        target: The input.
        delay: Number of macro steps by which the value is delayed.
        where: Location in the scenario file, for messages.
        gain: Factor that is applied after the conversion of units.
        offset: Value that is added after `gain`, in the unit of the input.
        term: Number, from 1, of the value among those that are added at the input; 0: it is the
            only one.
        convert: Booleans and all integers are converted to floating-point numbers.
        interpolation: Course of the input within a step: constant, or linear with the slope that
            the source gives, or else through the last two values of the output.
    """

    source: Endpoint
    target: Endpoint
    delay: int = 0
    where: str = ""
    gain: float = 1.0
    offset: float = 0.0
    term: int = 0
    convert: bool = False
    interpolation: Interpolation = "hold"

    @property
    def is_mapped(self) -> bool:
        """True if a gain, an offset or an addition changes the value."""
        return (self.gain, self.offset, self.term) != (1.0, 0.0, 0)


#: parallel execution of the components of a stage on threads: if it is faster, always, or never
Parallel = Literal["auto", True, False]


IterationMethod = Literal["fixed-point", "newton"]


@dataclass(frozen=True, slots=True)
class Iteration:
    """Repetition of the stages of a group from one state until their connected outputs converge.

    Attributes:
        tolerance: A value y has converged if it differs from its previous value by at most
            tolerance * (1 + |y|).
        max_rounds: Number of rounds without convergence after which the run fails; of Newton's
            method, number of its steps.
        method: Fixed point, or Newton's method, whose Jacobian takes one more round for each
            connected output and step.
    """

    tolerance: float
    max_rounds: int
    method: IterationMethod = "fixed-point"


@dataclass(frozen=True, slots=True)
class Group:
    """Nested system: components with their own stages, together one member of an outer stage."""

    name: str
    stages: tuple[Stage, ...]
    parallel: Parallel = "auto"
    iteration: Iteration | None = None


Stage = tuple["str | Group", ...]


def component_names(stages: Iterable[Stage]) -> Iterator[str]:
    """Yield the names of all components in the stages and the groups inside them."""
    for stage in stages:
        for member in stage:
            if isinstance(member, Group):
                yield from component_names(member.stages)
            else:
                yield member


def iterate_groups(stages: Iterable[Stage]) -> Iterator[Group]:
    """Yield all groups in the stages, also those inside groups."""
    for member in chain.from_iterable(stages):
        if isinstance(member, Group):
            yield member
            yield from iterate_groups(member.stages)


class VariableElement(NamedTuple):
    """A variable and the index of one of its elements (row-major)."""

    variable: Variable
    element: int


@dataclass(frozen=True)
class System:
    """Components with their connections and stages.

    Attributes:
        components: All components by name.
        connections: Connections between their variables.
        stages: Stages, which step one after the other. Outputs reach other components of the same
            stage in the next macro step.
        periods: Periods (s) of components that step less often than every macro step.
        start_values: Parameters and start values by component and variable name.
        aliases: Additional names under which outputs are recorded.
        parallel: Parallel execution of the components of a stage; does not change the results.
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
        """Every scalar of every component, by component name and scalar name."""
        slots: dict[str, dict[str, VariableElement]] = {}
        for name, component in self.components.items():
            own = slots[name] = {}
            for variable in component.variables:
                for i, slot in enumerate(variable.scalar_names):
                    own[slot] = VariableElement(variable, i)
        return slots

    def find_element(self, endpoint: Endpoint) -> VariableElement:
        """Return the variable and element of an existing endpoint."""
        return self.slots[endpoint.component][endpoint.scalar]

    def problems(self) -> list[Problem]:
        """Return all errors of connections and stages; empty if the system can run."""
        return [*self._find_stage_problems(), *self._find_connection_problems()]

    def _find_stage_problems(self) -> Iterator[Problem]:
        seen: set[str] = set()
        unknown = 0
        subject = ("algorithm", "stages")
        named = set(component_names(self.stages))
        unnamed = [name for name in self.components if name not in named]
        for name in component_names(self.stages):
            if name not in self.components:
                unknown += 1
                yield Problem(
                    f'unknown component "{name}"{did_you_mean(name, unnamed)}', subject=subject
                )
            elif name in seen:
                yield Problem(f'component "{name}" is in the stages twice', subject=subject)
            seen.add(name)
        for group in iterate_groups(self.stages):
            if group.iteration:
                yield from self._find_iteration_problems(group)
        missing = dict.fromkeys(
            _unlisted_member(name, seen) for name in self.components if name not in seen
        )
        if len(missing) > unknown:  # otherwise the unknown names probably stand for them
            for name in missing:
                text = f'component "{name}" is in no stage of "algorithm", so it would never step'
                yield Problem(text, subject=("components", name))

    def _find_iteration_problems(self, group: Group) -> Iterator[Problem]:
        repeated = f"the stages of {group.name} are iterated"
        for name in component_names(group.stages):
            if name in self.components and not self.components[name].has_state:
                text = (
                    f'{repeated}, but "{name}" cannot return to a state (FMI: canGetAndSetFMUState)'
                )
                yield Problem(text, subject=("components", name))
            if name in self.periods:
                yield Problem(
                    f'{repeated}, so "{name}" cannot have a period of its own',
                    subject=("components", name, "period"),
                )

    def _find_connection_problems(self) -> Iterator[Problem]:
        by_target: dict[Endpoint, Connection] = {}
        refused: dict[tuple[str, str, str, str], list[Connection]] = defaultdict(list)
        for connection in self.connections:
            source = self._find_endpoint_problem(connection.source, "output")
            target = self._find_endpoint_problem(connection.target, "input")
            if source or target:
                yield from (Problem(text, connection.where) for text in (source, target) if text)
                continue
            other = by_target.setdefault(connection.target, connection)
            if other is not connection and not 0 < other.term < connection.term:
                text = (
                    f"input {connection.target} is connected twice: it is already fed by "
                    f"{other.source}"
                )
                yield Problem(text, connection.where)
            source_variable, target_variable = (
                self.find_element(end).variable for end in (connection.source, connection.target)
            )
            text = incompatibility(source_variable, target_variable, connection.convert)
            if text and text == unit_conflict(source_variable, target_variable):
                text += self._unit_sources(connection)
            if connection.is_mapped and not text and target_variable.type not in FLOAT_TYPES:
                text = (
                    "gains, offsets and sums are for inputs of floating-point numbers, found "
                    f"{target_variable.type}"
                )
            if connection.interpolation == "linear" and not text:
                text = self._linear_problem(connection)
            if text:
                refused[
                    connection.where, connection.source.component, connection.target.component, text
                ].append(connection)
        for (where, _, _, text), (first, *others) in refused.items():
            more = f", and {count_noun(len(others), 'more element')} likewise" if others else ""
            yield Problem(f"{first.source} cannot feed {first.target}{more}: {text}", where)

    def _unit_sources(self, connection: Connection) -> str:
        """Return the declarations of the units of both ends, as far as the components know them."""
        found = ""
        for end in (connection.source, connection.target):
            variable = self.find_element(end).variable
            if variable.unit and (
                place := self.components[end.component].unit_source(variable.name)
            ):
                found += f'; "{variable.unit.name}" is declared by {place}'
        return found

    def _linear_problem(self, connection: Connection) -> str:
        """Return the reason why an input cannot change linearly within a step; "" if it can."""
        name = connection.target.component
        if not self.components[name].interpolates_inputs:
            return (
                f'"interpolation" is "linear", but "{name}" does not interpolate its inputs (FMI: '
                "canInterpolateInputs)"
            )
        if connection.delay or connection.term:
            return '"interpolation" is "linear", so it cannot have a delay or be part of a sum'
        if {
            self.find_element(end).variable.type for end in (connection.source, connection.target)
        } != {"Float64"}:
            return '"interpolation" is "linear", expected two variables of the type Float64'
        if {name, connection.source.component} & self.periods.keys():
            return '"interpolation" is "linear", so both components must step in every macro step'
        return ""

    def _find_endpoint_problem(self, end: Endpoint, causality: str) -> str:
        if end.component not in self.components:
            return (
                f'unknown component "{end.component}"{did_you_mean(end.component, self.components)}'
            )
        slots = self.slots[end.component]
        if end.scalar not in slots:
            valid = (
                name for name, element in slots.items() if element.variable.causality == causality
            )
            return (
                f'component "{end.component}" has no variable '
                f'"{end.scalar}"{did_you_mean(end.scalar, valid)}'
            )
        if (actual := slots[end.scalar].variable.causality) != causality:
            return f"{end} is of causality {actual}, expected an {causality}"
        return ""


def _unlisted_member(name: str, listed: Collection[str]) -> str:
    """Return the outermost system around a component whose stages contain no component.

    The component itself if there is none.
    """
    parts = name.split(".")
    for n in range(1, len(parts)):
        system = ".".join(parts[:n])
        if not any(each.startswith(f"{system}.") for each in listed):
            return system
    return name


INTEGER_TYPES = frozenset(
    {"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"}
)
FLOAT_TYPES = frozenset({"Float64", "Float32"})


def incompatibility(source: Variable, target: Variable, convert: bool = False) -> str:
    """Return the reason why values of `source` cannot be converted to `target`; "" if they can.

    Args:
        source: The output.
        target: The input.
        convert: Booleans and all integers are converted to floating-point numbers.
    """
    on_request = target.type in FLOAT_TYPES and source.type in INTEGER_TYPES | {"Boolean"}
    if not (_is_convertible(source, target) or (convert and on_request)):
        hint = ' unless the connection has "convert": true' if on_request else ""
        return f"type {source.type} cannot be converted to {target.type}{hint}"
    return unit_conflict(source, target)


def unit_conflict(source: Variable, target: Variable) -> str:
    """Return the reason why the units of two variables cannot be converted; "" if they can."""
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
    return {source.type, target.type} <= INTEGER_TYPES and bool(
        np.can_cast(source.dtype, target.dtype, "safe")
    )
