"""Result of the analysis of a model: schedule, roles of parameters, default values."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import Any

from ..model.evaluate import Evaluator, convert_to_type
from ..model.flat_model import Model, Variable, is_input
from ..model.syntax_tree import raise_model_error
from ..model.traversal import variable_names
from .computation_order import Schedule, build_schedule, declared_value, start_value


@dataclass(frozen=True)
class ParameterRoles:
    """The names of a model's parameters and constants, by role."""

    #: can be set by the importer
    settable: Sequence[str]
    #: have a constant value
    fixed: Sequence[str]
    #: are computed from other parameters, in this order
    dependent: Sequence[str]
    #: settable parameters that determine the start or period of a clock; changes after the
    #: initialization have no effect
    clock_parameters: Sequence[str]


def classify_parameters(model: Model, schedule: Schedule) -> ParameterRoles:
    """Determine the role of each parameter and constant.

    Args:
        model: The flat model.
        schedule: Its order of computation, with the clocks.

    Raises:
        InputError: Parameters depend on each other cyclically.
    """
    parameters = [v for v in model.variables.values() if v.variability in ("parameter", "constant")]
    dependencies = {v.name: _dependencies(v) for v in parameters}
    for name, others in dependencies.items():
        if invalid := [other for other in others if other not in dependencies]:
            raise_model_error(
                f"the parameter {name} depends on {invalid[0]}, which is not a parameter",
                model.variables[name].where,
            )
    settable = [
        v.name
        for v in parameters
        if v.variability == "parameter"
        and not dependencies[v.name]
        and v.type != "ExternalObject"
        and not (v.final or v.protected or v.name in model.structural)
    ]
    try:
        order = TopologicalSorter(dependencies).static_order()
        dependent = [
            name
            for name in order
            if dependencies[name] or model.variables[name].type == "ExternalObject"
        ]
    except CycleError as error:
        raise_model_error(
            f"these parameters depend on each other: {', '.join(error.args[1])}",
            model.variables[error.args[1][0]].where,
        )
    used_by_clocks: set[str] = set()
    for clock in schedule.clocks:
        for name in variable_names((clock.start, clock.period)):
            used_by_clocks.update(_transitive_dependencies(name, dependencies))
    return ParameterRoles(
        settable,
        [v.name for v in parameters if v.name not in settable and v.name not in dependent],
        dependent,
        [name for name in settable if name in used_by_clocks],
    )


def _dependencies(parameter: Variable) -> list[str]:
    value = parameter.binding if parameter.binding is not None else parameter.start
    return sorted(variable_names(value))


def _transitive_dependencies(name: str, dependencies: dict[str, list[str]]) -> Iterator[str]:
    yield name
    for other in dependencies.get(name, ()):
        yield from _transitive_dependencies(other, dependencies)


class AnalysedModel:
    """A flat model with its schedule, the roles of its parameters and its default values.

    Scalars are float, int or bool, arrays are NumPy arrays.

    Args:
        model: The flat model, with continuous states introduced.

    Raises:
        EvaluationError: A default value cannot be computed.
        InputError: The model has structural errors, for example an algebraic loop.
    """

    def __init__(self, model: Model):
        self.model = model
        self.schedule = build_schedule(model)
        self.parameter_roles = classify_parameters(model, self.schedule)
        #: variable -> value
        self.values: dict[str, Any] = {}
        self.evaluate = Evaluator(model.functions, self.values)
        for variable in model.variables.values():
            self.assign(variable.name, 1 if variable.type == "Enumeration" else 0)
        for name in (*self.parameter_roles.settable, *self.parameter_roles.fixed):
            self.assign(name, self.evaluate(declared_value(model, name)))
        self.update_dependent_parameters()
        self.apply_start_values(inputs=True)

    def assign(self, name: str, value: Any) -> None:
        """Set a variable to a value of its type and shape."""
        variable = self.model.variables[name]
        self.values[name] = convert_to_type(value, variable.type, variable.shape)

    def update_dependent_parameters(self) -> None:
        """Compute the parameters that depend on others."""
        for name in self.parameter_roles.dependent:
            self.assign(name, self.evaluate(declared_value(self.model, name)))

    def apply_start_values(self, inputs: bool) -> None:
        """Set all variables but parameters to their start values.

        Inputs are only set if `inputs` is true.
        """
        for variable in self.model.variables.values():
            if variable.variability not in ("parameter", "constant") and (
                inputs or not is_input(variable)
            ):
                self.assign(variable.name, self.evaluate(start_value(self.model, variable.name)))
