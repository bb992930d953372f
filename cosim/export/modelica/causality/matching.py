"""Which continuous equation defines which variable.

Only equations with a variable alone on one side are accepted (`y = f(...)`, a connection `a = b`): nothing is solved for.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import product
from math import prod

from ..model.flat_model import (
    Assign,
    Builtin,
    Colon,
    Equation,
    Expression,
    Index,
    Literal,
    Model,
    Name,
    Variable,
    raise_model_error,
)

#: one scalar: the name of the variable and the place of the element, row by row
ScalarKey = tuple[str, int]


def scalar_keys(variables: Mapping[str, Variable], reference: Name | Index) -> set[ScalarKey]:
    """The scalars that a reference names; subscripts that are not literal mean the whole variable."""
    name = reference if isinstance(reference, Name) else reference.base
    if not isinstance(name, Name) or (variable := variables.get(name.name)) is None:
        return set()
    shape = variable.shape
    if isinstance(reference, Name) or not all(isinstance(s, Literal | Colon) for s in reference.subscripts):
        return {(name.name, k) for k in range(prod(shape))}
    choices = [range(n) if isinstance(s, Colon) else [int(s.value) - 1] for s, n in zip(reference.subscripts, shape)]  # type: ignore[union-attr]  # noqa: B905
    choices += [range(n) for n in shape[len(choices) :]]
    return {(name.name, _flat_index(index, shape)) for index in product(*choices)}


def _flat_index(index: Iterable[int], shape: Iterable[int]) -> int:
    place = 0
    for k, n in zip(index, shape, strict=True):
        place = place * n + k
    return place


def match_equations(model: Model, assigned: Collection[str]) -> list[Assign]:
    """The continuous equations as assignments, in the order in which they were written.

    `assigned` are the variables that when-clauses and algorithms define. An equation between two variables (`a = b`) defines
    the one that nothing else defines, so those wait until all others have found their variable.
    """
    defined = {key for name in assigned for key in scalar_keys(model.variables, Name(name))}
    for variable in model.variables.values():
        if variable.variability in ("constant", "parameter") or is_input(variable):
            defined |= scalar_keys(model.variables, Name(variable.name))
    pending, found = list(enumerate(model.equations)), dict[int, Assign]()
    while pending:
        waiting = []
        for number, equation in pending:
            sides = _candidates(model, equation, defined)
            if len(sides) == 1:
                defined |= scalar_keys(model.variables, sides[0].target)
                found[number] = sides[0]
            else:
                waiting.append((number, equation))
        if len(waiting) == len(pending):
            _raise_unmatched([equation for _, equation in waiting], model, defined)
        pending = waiting
    _check_complete(model, defined)
    return [found[number] for number in sorted(found)]


def is_input(variable: Variable) -> bool:
    """Whether the value comes from outside the model (inputs of inner blocks do not)."""
    return variable.causality == "input" and variable.top_level


def _candidates(model: Model, equation: Equation, defined: Collection[ScalarKey]) -> list[Assign]:
    """The ways to read the equation as an assignment to a scalar or array that nothing has defined yet."""
    sides = ((equation.left, equation.right), (equation.right, equation.left))
    return [
        Assign(side, other, equation.where)
        for side, other in sides
        if isinstance(side, Name | Index) and (named := scalar_keys(model.variables, side)) and not named & set(defined)
    ]


def _raise_unmatched(equations: list[Equation], model: Model, defined: Collection[ScalarKey]) -> None:
    equation = equations[0]
    if _candidates(model, equation, defined):
        names = ", ".join(sorted({side.name for e in equations for side in (e.left, e.right) if isinstance(side, Name)}))
        raise_model_error(
            f"these variables are only connected to each other, nothing gives them a value: {names}", equation.where
        )
    raise_model_error(
        "this equation defines no variable: write it with a variable, or der() of one, alone on one side "
        "that no other equation defines",
        equation.where,
    )


def _check_complete(model: Model, defined: Collection[ScalarKey]) -> None:
    for variable in model.variables.values():
        if not scalar_keys(model.variables, Name(variable.name)) <= set(defined):
            raise_model_error(f"no equation gives {variable.name} a value", variable.where)


def match_initial_equations(model: Model, assigned: Collection[str]) -> list[Assign]:
    """Initial equations as assignments to continuous states and to what a when-clause or algorithm assigns later.

    `pre(x) = ...` is x.
    """
    return [_initial_assignment(model, equation, assigned) for equation in model.initial_equations]


def _initial_assignment(model: Model, equation: Equation, assigned: Collection[str]) -> Assign:
    for side, other in ((equation.left, equation.right), (equation.right, equation.left)):
        target: Expression = side.arguments[0] if isinstance(side, Builtin) and side.name == "pre" else side
        if isinstance(target, Name | Index) and {name for name, _ in scalar_keys(model.variables, target)} & set(assigned):
            return Assign(target, other, equation.where)
    raise_model_error(
        "an initial equation must have a continuous state, or a variable that a when-clause assigns, alone on one side",
        equation.where,
    )
