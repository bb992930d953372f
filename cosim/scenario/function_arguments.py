"""Arguments of KPIs, figures and the scene that are taken from the system.

They include the values that the caller sets.

- The argument {"from": NAME} is a parameter or start value ("usv.waypoint_x": a list for
  waypoint_x[1], waypoint_x[2], ...), or
  with a JSON pointer ("/components/plant/arguments/platforms") an entry of the expanded scenario.
- The key "from" of a function names components, prefixes of variables or JSON pointers of
  objects. Arguments that are not given
  are taken from these by their names.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count, takewhile
from typing import Any, TypeVar

from ..core.component import Variable
from ..core.errors import Problem, did_you_mean
from .evaluation_schema import CallSpec, FunctionSpec
from .json_document import find_value, missing_value, pointer_keys
from .name_resolution import Target, UnknownNameError, resolve_name
from .named_functions import (
    RECORDED_INPUTS,
    declared_arguments,
    definition_problem,
    unknown_signals,
    wrong_types,
)
from .nested_systems import Node
from .schema import ScenarioSpec
from .schema_types import INVALID, accepted

C = TypeVar("C", bound=CallSpec)


@dataclass
class FunctionResolver:
    """Resolver of the arguments of a scenario's functions.

    Attributes:
        root: The scenario.
        variables: Variables of all components by full name of the component and by name.
        start_values: Values that the scenario and the caller set, by component and variable.
        signals: Names of the recorded signals; None if they are not all known.
        problems: Arguments that cannot be resolved.
        left_out: Reasons why optional functions are left out.
    """

    root: Node
    variables: Mapping[str, Mapping[str, Variable]]
    start_values: Mapping[str, Mapping[str, Any]]
    signals: Collection[str] | None
    problems: list[Problem] = field(default_factory=list)
    left_out: list[Problem] = field(default_factory=list)

    def resolve(self, spec: ScenarioSpec) -> ScenarioSpec:
        """Return the scenario with the values of all arguments.

        Functions with problems, and optional functions that lack a signal or value, are replaced by
        placeholders.
        """
        resolved: dict[str, Any] = {}
        for kind in ("kpis", "figures"):
            functions = resolved[kind] = list(getattr(spec, kind))
            for i, function in accepted(functions):
                functions[i] = self._resolve_function(kind, i, function)
        scene = spec.scene and self._resolve_arguments(spec.scene, self.problems, "scene")
        return spec.model_copy(update={**resolved, "scene": scene})

    def _resolve_function(self, kind: str, i: int, spec: FunctionSpec) -> Any:
        if definition_problem(spec, self.root.folder):
            return spec
        found: list[Problem] = []
        resolved = self._resolve_arguments(spec, found, kind, i)
        if not found and (wrong := self._type_problems(resolved, spec, kind, i)):
            self.problems += wrong
            return INVALID
        if not spec.optional:
            self.problems += [problem for problem in found if problem.message]
            return INVALID if found else resolved
        if self.signals is not None:
            unknown = unknown_signals(resolved, self.root, self.signals)
            found += [
                Problem(text, self.root.where(kind, i, "arguments", argument))
                for argument, text in unknown
            ]
        if found and found[0].message:
            noun = "KPI" if kind == "kpis" else "figure"
            reason = found[0].message.removesuffix(RECORDED_INPUTS)
            self.left_out.append(
                replace(found[0], message=f'{noun} "{spec.name}" is left out: {reason}')
            )
        return INVALID if found else resolved

    def _resolve_arguments(self, spec: C, problems: list[Problem], *path: str | int) -> C:
        """Return a function with the values of its arguments.

        Arguments without a value are added to `problems`, without a message if the reason has
        already been reported.
        """
        arguments = dict(spec.arguments)
        for name, argument in spec.arguments.items():
            try:
                arguments[name] = self._resolve_value(argument)
            except UnknownNameError as error:
                problems.append(Problem(str(error), self.root.where(*path, "arguments", name)))
        if spec.sources:
            for name, is_required in declared_arguments(spec, self.root.folder).items():
                try:
                    if name not in arguments:
                        arguments[name] = self._value_from(spec.sources, name)
                except UnknownNameError as error:
                    if is_required:
                        text = str(error) and f"{error} for the argument {name}"
                        problems.append(Problem(text, self.root.where(*path, "from")))
        return spec.model_copy(update={"arguments": arguments, "sources": []})

    def _type_problems(self, resolved: CallSpec, spec: CallSpec, *path: str | int) -> list[Problem]:
        """Return the problems of values that do not have the annotated type.

        `spec` is the function before `resolved`.
        """
        problems = []
        for name, text in wrong_types(resolved, self.root.folder):
            if name in spec.arguments:
                problems.append(Problem(text, self.root.where(*path, "arguments", name)))
            else:
                problems.append(Problem(f"argument {name}: {text}", self.root.where(*path, "from")))
        return problems

    def _value_from(self, sources: Sequence[str], name: str) -> Any:
        """Return the value of an argument from the first source that has it."""
        errors = []
        for source in sources:
            separator = "/" if source.startswith("/") else "."
            try:
                return self._resolve_name(source + separator + name)
            except UnknownNameError as error:
                errors.append(error)
        raise errors[0]

    def _resolve_value(self, value: Any) -> Any:
        if isinstance(value, list):
            return [self._resolve_value(each) for each in value]
        if not isinstance(value, dict):
            return value
        if set(value) != {"from"} or not isinstance(value["from"], str):
            return {key: self._resolve_value(each) for key, each in value.items()}
        return self._resolve_name(value["from"])

    def _resolve_name(self, name: str) -> Any:
        if not name.startswith("/"):
            return self._value_of(name)
        keys = pointer_keys(name)
        value, depth = find_value(self.root.document.value, keys)
        if depth < len(keys):
            raise UnknownNameError(missing_value(self.root.document.value, name))
        return value

    def _value_of(self, name: str) -> Any:
        """Return the value of a parameter or start value.

        A port of a nested system has that of its first inner variable.
        """
        target, *_ = resolve_name(self.root, name, ("parameters", "inputs"), include_inner=True)
        if target.component not in self.variables:
            raise UnknownNameError
        variables = self.variables[target.component]
        if target.prefix in variables:
            return self._value_of_variable(target, variables[target.prefix])
        names = (f"{target.prefix}[{i}]" for i in count(1))
        elements = [variables[each] for each in takewhile(variables.__contains__, names)]
        if not elements:
            known = [each.name for each in variables.values() if each.causality != "output"]
            text = f'component "{target.component}" has no parameter "{target.prefix}"'
            raise UnknownNameError(text + did_you_mean(target.prefix, known))
        return [self._value_of_variable(target, element) for element in elements]

    def _value_of_variable(self, target: Target, variable: Variable) -> Any:
        value = self.start_values.get(target.component, {}).get(variable.name, variable.start)
        if variable.causality == "output" or value is None:
            reason = "is an output" if variable.causality == "output" else "has no start value"
            raise UnknownNameError(
                f'"{target.component}.{variable.name}" {reason}, expected a parameter'
            )
        if variable.shape and not isinstance(value, list | tuple):
            return [value] * len(variable.scalar_names)
        return list(value) if isinstance(value, tuple) else value


def without_placeholders(spec: ScenarioSpec) -> ScenarioSpec:
    """Return a resolved scenario without the placeholders of functions."""
    kpis = [each for _, each in accepted(spec.kpis)]
    figures = [each for _, each in accepted(spec.figures)]
    return spec.model_copy(update={"kpis": kpis, "figures": figures})
