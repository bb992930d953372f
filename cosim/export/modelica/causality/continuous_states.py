"""Continuous states.

Replacement of der(x) by a variable with the name "der(x)", which an equation must define.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ..model.flat_model import Model, Variable, derivative_name, internal_variable
from ..model.syntax_tree import (
    Builtin,
    Expression,
    Index,
    Name,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import rewrite, walk
from .matching import is_input

_SECTIONS = (
    "equations",
    "whens",
    "algorithms",
    "asserts",
    "initial_equations",
    "initial_algorithms",
)


def introduce_derivatives(model: Model) -> Model:
    """Return the model with its continuous states, and with variables for their derivatives instead of der().

    Raises:
        InputError: The argument of der() is not a continuous Real variable.
    """
    der_calls = dict(_der_calls(model))
    for name, call in der_calls.items():
        _check_state(model, name, call)
    states = tuple(name for name in model.variables if name in der_calls)
    return replace(
        model,
        variables={
            **model.variables,
            **{
                derivative_name(name): derivative_variable(model.variables[name]) for name in states
            },
        },
        states=states,
        **{section: rewrite(getattr(model, section), _replace_der) for section in _SECTIONS},
    )


def _der_calls(model: Model) -> Iterator[tuple[str, Builtin]]:
    """Yield the argument of each der() (the variable name), with the call."""
    for item in walk(tuple(getattr(model, section) for section in _SECTIONS)):
        if isinstance(item, Builtin) and item.name == "der":
            yield referenced_variable(_der_argument(item)), item


def _der_argument(call: Builtin) -> Name | Index:
    (argument,) = call.arguments
    if not (
        isinstance(argument, Name)
        or (isinstance(argument, Index) and isinstance(argument.base, Name))
    ):
        raise_model_error(
            (
                "der() of an expression is not supported; declare a variable x for the expression "
                "and use der(x)"
            ),
            call.where,
        )
    return argument


def _check_state(model: Model, name: str, call: Builtin) -> None:
    variable = model.variables.get(name)
    if (
        variable is None
        or variable.type != "Real"
        or variable.variability != "continuous"
        or is_input(variable)
    ):
        raise_model_error(
            f"der({name}): {name} is not a continuous Real variable of the model", call.where
        )


def derivative_variable(state: Variable) -> Variable:
    """Return the declaration of the derivative of a state."""
    return internal_variable(state, derivative_name(state.name))


def _replace_der(node: Any) -> Expression | Any:
    if not (isinstance(node, Builtin) and node.name == "der"):
        return node
    reference = _der_argument(node)
    name = Name(derivative_name(referenced_variable(reference)), node.where)
    return replace(reference, base=name) if isinstance(reference, Index) else name
