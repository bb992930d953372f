"""Matching: assignment of each continuous equation to the variable that it defines.

Equations are not solved symbolically. Therefore one side must be a variable (`y = f(...)`, or a
connection `a = b`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from itertools import product
from math import prod

from ..model.flat_model import Equation, Model, Variable, previous_name
from ..model.syntax_tree import (
    Assign,
    Builtin,
    Colon,
    Expression,
    Index,
    Literal,
    Name,
    raise_model_error,
)

#: a scalar: variable name and row-major index of the element
ScalarKey = tuple[str, int]


def scalar_keys(variables: Mapping[str, Variable], reference: Name | Index) -> set[ScalarKey]:
    """Return the scalars that a reference denotes.

    With a non-literal subscript, all elements of the variable.
    """
    name = reference if isinstance(reference, Name) else reference.base
    if not isinstance(name, Name) or (variable := variables.get(name.name)) is None:
        return set()
    shape = variable.shape
    if isinstance(reference, Name) or not all(
        isinstance(s, Literal | Colon) for s in reference.subscripts
    ):
        return {(name.name, k) for k in range(prod(shape))}
    literals = [int(s.number) - 1 if isinstance(s, Literal) else None for s in reference.subscripts]
    literals += [None] * (len(shape) - len(literals))
    indices = [
        range(n) if k is None else range(k, k + 1) for k, n in zip(literals, shape, strict=False)
    ]
    return {(name.name, _flat_index(index, shape)) for index in product(*indices)}


def _flat_index(index: Iterable[int], shape: Iterable[int]) -> int:
    result = 0
    for k, n in zip(index, shape, strict=True):
        result = result * n + k
    return result


def match_equations(model: Model, assigned: Collection[str]) -> list[Assign]:
    """Match the continuous equations with variables.

    An equation between two variables (`a = b`) defines the one that no other equation defines. It
    is matched after the other equations have been matched.

    Args:
        model: The flat model.
        assigned: The variables that when-clauses and algorithms assign.

    Returns:
        The equations as assignments, in the order of the model.

    Raises:
        InputError: An equation defines no variable, or a variable has no equation.
    """
    defined = {key for name in assigned for key in scalar_keys(model.variables, Name(name))}
    for name in model.hybrid.remembered if model.hybrid else ():
        defined |= scalar_keys(model.variables, Name(previous_name(name)))
    for variable in model.variables.values():
        if variable.variability in ("constant", "parameter") or is_input(variable):
            defined |= scalar_keys(model.variables, Name(variable.name))
    pending, matched = list(enumerate(model.equations)), dict[int, Assign]()
    while pending:
        unmatched = []
        for number, equation in pending:
            candidates = _candidates(model, equation, defined)
            if len(candidates) == 1:
                defined |= scalar_keys(model.variables, candidates[0].target)
                matched[number] = candidates[0]
            else:
                unmatched.append((number, equation))
        if len(unmatched) == len(pending):
            _raise_unmatched([equation for _, equation in unmatched], model, defined)
        pending = unmatched
    _check_complete(model, defined)
    return [matched[number] for number in sorted(matched)]


def is_input(variable: Variable) -> bool:
    """Return whether a variable is an input of the model itself.

    Neither one of a component nor a protected connector.
    """
    return variable.causality == "input" and variable.top_level and not variable.protected


def _candidates(model: Model, equation: Equation, defined: Collection[ScalarKey]) -> list[Assign]:
    """Return the assignments of an undefined variable that are equivalent to the equation.

    None, one or two.
    """
    sides = ((equation.left, equation.right), (equation.right, equation.left))
    return [
        Assign(side, other, equation.where)
        for side, other in sides
        if isinstance(side, Name | Index)
        and (keys := scalar_keys(model.variables, side))
        and not keys & set(defined)
    ]


def _raise_unmatched(
    equations: list[Equation], model: Model, defined: Collection[ScalarKey]
) -> None:
    equation = equations[0]
    if _candidates(model, equation, defined):
        names = ", ".join(
            sorted(
                {
                    side.name
                    for e in equations
                    for side in (e.left, e.right)
                    if isinstance(side, Name)
                }
            )
        )
        raise_model_error(
            (
                "these variables are only connected to each other, no equation gives them a "
                f"value: {names}"
            ),
            equation.where,
        )
    raise_model_error(
        (
            "this equation defines no variable: one side must be a variable, or der() of one, that "
            "no other equation defines"
        ),
        equation.where,
    )


def _check_complete(model: Model, defined: Collection[ScalarKey]) -> None:
    for variable in model.variables.values():
        if not scalar_keys(model.variables, Name(variable.name)) <= set(defined):
            raise_model_error(f"no equation gives {variable.name} a value", variable.where)


def match_initial_equations(model: Model, assigned: Collection[str]) -> list[Assign]:
    """Match the initial equations with variables; an equation `pre(x) = ...` defines x.

    Args:
        model: The flat model.
        assigned: The continuous states and the variables that when-clauses and algorithms assign.

    Returns:
        The initial equations as assignments.

    Raises:
        InputError: An initial equation defines none of these variables.
    """
    return [_initial_assignment(model, equation, assigned) for equation in model.initial_equations]


def _initial_assignment(model: Model, equation: Equation, assigned: Collection[str]) -> Assign:
    assignments = []
    for side, other in ((equation.left, equation.right), (equation.right, equation.left)):
        target: Expression = (
            side.arguments[0] if isinstance(side, Builtin) and side.name == "pre" else side
        )
        if isinstance(target, Name | Index) and {
            name for name, _ in scalar_keys(model.variables, target)
        } & set(assigned):
            assignments.append(Assign(target, other, equation.where))
    if not assignments:
        raise_model_error(
            (
                "one side of an initial equation must be a continuous state, or a variable that a "
                "when-clause assigns"
            ),
            equation.where,
        )
    return assignments[0]
