"""Continuous states: der(x) becomes a variable of its own, named "der(x)", that an equation has to define."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ..model.flat_model import Builtin, Expression, Index, Model, Name, Variable, base_name, derivative, refuse
from ..model.traversal import rewrite, walk
from .matching import is_input

_SECTIONS = ("equations", "whens", "algorithms", "asserts", "initial_equations", "initial_algorithms")


def with_states(model: Model) -> Model:
    """The same model with `states`, and with their derivatives as variables instead of der().

    Raises InputError for the derivative of anything but a continuous Real variable.
    """
    found = dict(_derivatives(model))
    for name, call in found.items():
        _check(model, name, call)
    states = tuple(name for name in model.variables if name in found)
    return replace(
        model,
        variables={**model.variables, **{derivative(name): _rate(model.variables[name]) for name in states}},
        states=states,
        **{section: rewrite(getattr(model, section), _renamed) for section in _SECTIONS},
    )


def _derivatives(model: Model) -> Iterator[tuple[str, Builtin]]:
    """Every variable under der(), with the call."""
    for item in walk(tuple(getattr(model, section) for section in _SECTIONS)):
        if isinstance(item, Builtin) and item.name == "der":
            yield base_name(_reference(item)), item


def _reference(call: Builtin) -> Name | Index:
    (argument,) = call.arguments
    if isinstance(argument, Name) or (isinstance(argument, Index) and isinstance(argument.base, Name)):
        return argument
    refuse("der() of an expression is not supported; give the expression a variable with an equation der(x) = ...", call.where)


def _check(model: Model, name: str, call: Builtin) -> None:
    variable = model.variables.get(name)
    if variable is None or variable.type != "Real" or variable.variability != "continuous" or is_input(variable):
        refuse(f"der({name}): {name} is not a continuous Real variable of the model", call.where)


def _rate(state: Variable) -> Variable:
    """The declaration of the derivative of a state."""
    return replace(
        state,
        name=derivative(state.name),
        causality="local",
        start=None,
        binding=None,
        protected=True,
        top_level=False,
        unit="",
        description="",
        minimum=None,
        maximum=None,
    )


def _renamed(node: Any) -> Expression | Any:
    if not (isinstance(node, Builtin) and node.name == "der"):
        return node
    reference = _reference(node)
    name = Name(derivative(base_name(reference)), node.where)
    return replace(reference, base=name) if isinstance(reference, Index) else name
