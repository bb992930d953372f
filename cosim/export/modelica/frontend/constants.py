"""Replacement of constants, structural parameters and Strings by literals.

Literals can determine array sizes, slices and loop ranges. The FMU contains Strings as literals in
calls of functions only.
"""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..model.arithmetic import EvaluationError, to_python_scalar
from ..model.evaluate import Evaluator
from ..model.flat_model import Equation, Model, Variable
from ..model.syntax_tree import (
    Array,
    Call,
    Comprehension,
    Expression,
    Literal,
    Name,
    Range,
)
from ..model.traversal import is_call, rewrite, rewrite_sections, unroll, variable_names, walk

_DISCRETE_TYPES = ("Integer", "Boolean", "Enumeration", "String")


def fold_constants(model: Model) -> Model:
    """Return the model with scalar constants and structural parameters as literals.

    Structural parameters select equations, branches or sizes. Their declarations remain in the
    model. Protected and final parameters of discrete types that depend on them only are replaced
    too.
    """
    model = _rewrite_model(_bind_parameters(model), partial(_fold_size, model=model))
    structural = _structural_parameters(model)
    foldable = {
        v.name: v for v in model.variables.values() if not v.shape and _is_foldable(v, structural)
    }
    literals: dict[str, Literal] = {}
    failed: set[str] = set()
    while ready := [
        v
        for v in foldable.values()
        if v.name not in literals | dict.fromkeys(failed)
        and variable_names(_value(v)) <= set(literals)
    ]:
        values = {name: literal.value for name, literal in literals.items()}
        for variable in ready:
            try:
                value = Evaluator(model.functions, dict(values))(_value(variable))
                literals[variable.name] = Literal(to_python_scalar(value), variable.type)
            except (EvaluationError, KeyError, TypeError):
                failed.add(variable.name)
    constants = {v.name for v in model.variables.values() if v.variability == "constant"} & set(
        literals
    )

    def fold(node: Any) -> Any:
        if isinstance(node, Name):
            return literals.get(node.name, node)
        return _unroll_known(node, model) if isinstance(node, Comprehension) else node

    return replace(
        _rewrite_model(model, fold, {name for name in model.variables if name not in constants}),
        structural=frozenset(structural),
    )


def _bind_parameters(model: Model) -> Model:
    """Return the model with initial equations of parameters (`fixed = false`) as bindings.

    Those that depend on variables or on the time become variables that are only computed at the
    initialization, and so do the parameters that depend on them.
    """
    free = {
        v.name
        for v in model.variables.values()
        if v.variability == "parameter" and v.fixed is False and 0 not in v.shape
    }
    known = {v.name for v in model.variables.values() if v.variability in ("constant", "parameter")}
    bindings: dict[str, Expression] = {}
    remaining = []
    for equation in model.initial_equations:
        name = equation.left.name if isinstance(equation.left, Name) else ""
        if name in free - set(bindings) and variable_names(equation.right) <= known:
            bindings[name] = equation.right
        else:
            remaining.append(equation)
    initialized = free - set(bindings)
    while dependent := [
        v
        for v in model.variables.values()
        if v.name not in initialized and _depends(v, initialized)
    ]:
        remaining += [
            Equation(Name(v.name, v.where), v.binding, v.where) for v in dependent if v.binding
        ]
        initialized |= {v.name for v in dependent}
    variables = {
        n: replace(v, binding=bindings[n]) if n in bindings else v
        for n, v in model.variables.items()
    }
    variables |= {
        n: replace(model.variables[n], variability="discrete", binding=None) for n in initialized
    }
    return replace(
        model,
        variables=variables,
        initial_equations=tuple(remaining),
        initialized=frozenset(initialized),
    )


def _depends(variable: Variable, names: set[str]) -> bool:
    """Return whether the binding of a parameter depends on variables."""
    return variable.variability == "parameter" and not names.isdisjoint(
        variable_names(variable.binding)
    )


def _rewrite_model(model: Model, change: Any, names: Iterable[str] | None = None) -> Model:
    """Return the model with `change` applied to all expressions.

    Only the variables `names` remain.
    """

    def change_variable(variable: Variable) -> Variable:
        expressions = ("start", "binding", "minimum", "maximum")
        return replace(
            variable, **{key: rewrite(getattr(variable, key), change) for key in expressions}
        )

    kept = model.variables if names is None else names
    variables = {
        name: change_variable(variable)
        for name, variable in model.variables.items()
        if name in kept
    }
    return replace(rewrite_sections(model, change), variables=variables)


def _fold_size(node: Any, model: Model) -> Any:
    """Replace `size()` of a variable by a number."""
    if not (is_call(node, "size") and isinstance(node.arguments[0], Name)):
        return node
    variable = model.variables.get(node.arguments[0].name)
    if variable is None or len(node.arguments) != 2 or not isinstance(node.arguments[1], Literal):
        return node
    return Literal(variable.shape[int(node.arguments[1].number) - 1], "Integer")


def _structural_parameters(model: Model) -> set[str]:
    """Return the parameters that determine the structure, and those that they depend on."""
    pending, found = list(model.structural), set[str]()
    while pending:
        name = pending.pop()
        variable = model.variables.get(name)
        if variable is None or name in found or variable.variability != "parameter":
            continue
        if variable.shape and variable.type == "Real":
            continue  # only its size matters, which cannot change
        found.add(name)
        pending += variable_names(_value(variable))
    return found


def _value(variable: Variable) -> Expression:
    return (
        variable.binding
        or variable.start
        or Literal(False if variable.type == "Boolean" else 0, variable.type)
    )


def _is_foldable(variable: Variable, structural: set[str]) -> bool:
    if variable.variability == "constant" or variable.name in structural:
        return True
    hidden = (
        variable.variability == "parameter"
        and (variable.protected or variable.final)
        and variable.fixed is not False
    )
    return hidden and variable.type in _DISCRETE_TYPES


def _unroll_known(node: Comprehension, model: Model) -> Expression:
    """Return an array constructor with an iterator as a list of elements, if its range is known."""
    if not isinstance(node.range, Range | Array) or variable_names(node.range):
        return node
    numbers = np.atleast_1d(Evaluator(model.functions, {})(node.range))
    literals = [Literal(to_python_scalar(number), "Integer") for number in numbers]
    return unroll(node, literals)


def string_parameters(model: Model) -> set[str]:
    """Return the String parameters, and those in String arguments of functions."""
    found = {
        v.name
        for v in model.variables.values()
        if v.type == "String" and v.variability == "parameter"
    }
    bindings = tuple((v.binding, v.start) for v in model.variables.values())
    for call in walk((bindings, model.equations, model.algorithms, model.whens)):
        if isinstance(call, Call):
            found |= variable_names(
                tuple(a for a, local in _inputs(call, model) if local.type == "String")
            )
    return {
        name
        for name in found
        if name in model.variables and model.variables[name].variability == "parameter"
    }


def fold_strings(model: Model) -> Model:
    """Return the model with String arguments as literals, without String parameters.

    Raises:
        EvaluationError: A String cannot be evaluated.
    """

    def fold(node: Any) -> Any:
        if not isinstance(node, Call):
            return node
        pairs = _inputs(node, model)
        return replace(
            node,
            arguments=tuple(
                _literal(a, model) if local.type == "String" else a for a, local in pairs
            ),
        )

    fixed = ("parameter", "constant")
    variables = {
        name: v
        for name, v in model.variables.items()
        if v.type != "String" or v.variability not in fixed
    }
    return replace(
        model,
        variables={
            name: replace(v, binding=rewrite(v.binding, fold), start=rewrite(v.start, fold))
            for name, v in variables.items()
        },
        equations=rewrite(model.equations, fold),
        algorithms=rewrite(model.algorithms, fold),
        whens=rewrite(model.whens, fold),
    )


def _inputs(call: Call, model: Model) -> list[tuple[Expression, Any]]:
    """Return the arguments of a call with the inputs of the function."""
    function = model.functions.get(call.function)
    return list(zip(call.arguments, function.inputs, strict=True)) if function else []


def _literal(node: Expression, model: Model) -> Expression:
    if isinstance(node, Literal) or variable_names(node):
        return node
    return Literal(Evaluator(model.functions, {})(node), "String")
