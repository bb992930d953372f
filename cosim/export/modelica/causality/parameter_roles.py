"""Who owns a parameter: which ones can be set, and in which order those that depend on others are computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from ..model.flat_model import Model, Variable, raise_model_error
from ..model.traversal import variable_names
from .schedule import Schedule

_STRUCTURAL_USES = {
    "ArrayDimension": "it decides the size of an array",
    "BranchSelection": "it selects equations (an if-expression would not)",
    "ForRange": "it decides the range of a for-loop",
}


@dataclass(frozen=True)
class ParameterRoles:
    """The parameters and constants of a model by name.

    `settable` can be set from outside; `fixed` have a value that nothing changes; `dependent` follow from others, in this
    order. `timing` are settable ones that clocks depend on: they have no effect after the initialization.
    """

    settable: Sequence[str]
    fixed: Sequence[str]
    dependent: Sequence[str]
    clock_parameters: Sequence[str]


def classify_parameters(model: Model, plan: Schedule) -> ParameterRoles:
    """Raises InputError where a settable parameter has shaped the model, and for parameters that depend on themselves."""
    parameters = [v for v in model.variables.values() if v.variability in ("parameter", "constant")]
    needs = {v.name: _dependencies(v) for v in parameters}
    _check_dependencies(model, needs)
    settable = [v.name for v in parameters if v.variability == "parameter" and not (needs[v.name] or v.final or v.protected)]
    _check_structure(model, needs, settable)
    try:
        order = [name for name in TopologicalSorter(needs).static_order() if needs[name]]
    except CycleError as error:
        raise_model_error(
            f"these parameters depend on each other: {', '.join(error.args[1])}", model.variables[error.args[1][0]].where
        )
    clocked = {
        base
        for clock in plan.clocks
        for name in variable_names((clock.start, clock.period))
        for base in _transitive_dependencies(name, needs)
    }
    return ParameterRoles(
        settable,
        [v.name for v in parameters if not needs[v.name] and v.name not in settable],
        order,
        [name for name in settable if name in clocked],
    )


def _dependencies(parameter: Variable) -> list[str]:
    value = parameter.binding if parameter.binding is not None else parameter.start
    return sorted(variable_names(value))


def _check_dependencies(model: Model, needs: dict[str, list[str]]) -> None:
    for name, others in needs.items():
        if unknown := [other for other in others if other not in needs]:
            raise_model_error(f"the parameter {name} depends on {unknown[0]}, which is no parameter", model.variables[name].where)


def _transitive_dependencies(name: str, needs: dict[str, list[str]]) -> Iterator[str]:
    yield name
    for other in needs.get(name, ()):
        yield from _transitive_dependencies(other, needs)


def _check_structure(model: Model, needs: dict[str, list[str]], settable: Sequence[str]) -> None:
    for structural in model.structural:
        used = [name for name in structural.parameters if name in model.variables]
        for owner in dict.fromkeys(base for name in used for base in _transitive_dependencies(name, needs)):
            if owner in settable:
                purpose = _STRUCTURAL_USES.get(structural.purpose, f"it decides the structure ({structural.purpose})")
                raise_model_error(
                    f"the parameter {owner} cannot be settable: {purpose}; declare it final or constant", structural.where
                )
