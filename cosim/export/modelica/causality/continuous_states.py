"""Continuous states: variables in place of der(x), and index reduction.

A variable in der() that an equation determines, for example the input of a derivative block, is not
a continuous state: its initial value cannot be chosen. The equation that determines it is
differentiated with respect to time, and so are the equations that determine the variables therein
(Pantelides 1988). der(x) then becomes an ordinary variable, the dummy derivative, which the
differentiated equation determines (Mattsson and Soederlind 1993). The matching chooses the variable
that is no state: it assigns states to equations only where no other unknown is left. The choice
is made once, so a constraint between states must be linear in this variable.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from ..model.flat_model import (
    SECTIONS,
    Equation,
    Model,
    Variable,
    derivative_name,
    given_variables,
    internal_variable,
    is_continuous,
    is_input,
)
from ..model.scalars import ScalarKey, scalar_keys
from ..model.syntax_tree import (
    Builtin,
    Expression,
    Index,
    Literal,
    Name,
    raise_model_error,
    referenced_variable,
)
from ..model.traversal import (
    assigned_names,
    is_call,
    rewrite_sections,
    variable_names,
    walk,
)
from .differentiation import Differentiation
from .equation_systems import EquationSystem


def introduce_derivatives(model: Model) -> Model:
    """Return the model with its continuous states, and with variables in place of der().

    Raises:
        InputError: The argument of der() is not a continuous Real variable.
    """
    der_calls = dict(_der_calls(model))
    for name, call in der_calls.items():
        variable = model.variables.get(name)
        if variable is None or not is_continuous(variable) or is_input(variable):
            raise_model_error(
                f"der({name}): {name} is not a continuous Real variable of the model", call.where
            )
    states = tuple(name for name in model.variables if name in der_calls)
    derivatives = {
        derivative_name(name): derivative_variable(model.variables[name]) for name in states
    }
    return replace(
        rewrite_sections(model, _replace_der),
        variables={**model.variables, **derivatives},
        states=states,
    )


def _der_calls(model: Model) -> Iterator[tuple[str, Builtin]]:
    """Yield the argument of each der() (the variable name), with the call."""
    for item in walk(tuple(getattr(model, section) for section in SECTIONS)):
        if is_call(item, "der"):
            yield referenced_variable(_der_argument(item)), item


def _der_argument(call: Builtin) -> Name | Index:
    (argument,) = call.arguments
    if not (
        isinstance(argument, Name)
        or (isinstance(argument, Index) and isinstance(argument.base, Name))
    ):
        raise_model_error(
            "der() of an expression is not supported; declare a variable x for the expression "
            "and use der(x)",
            call.where,
        )
    return argument


def derivative_variable(state: Variable) -> Variable:
    """Return the declaration of the derivative of a state."""
    return internal_variable(state, derivative_name(state.name))


def _replace_der(node: Any) -> Expression | Any:
    if not (is_call(node, "der")):
        return node
    reference = _der_argument(node)
    name = Name(derivative_name(referenced_variable(reference)), node.where)
    return replace(reference, base=name) if isinstance(reference, Index) else name


_MAX_ROUNDS = 20


def reduce_states(model: Model) -> Model:
    """Return the model with the states that equations determine as ordinary variables.

    Raises:
        InputError: The derivative of an input is needed, or an expression cannot be differentiated.
    """
    for _ in range(_MAX_ROUNDS if model.states else 0):
        assigned = assigned_names((model.whens, model.algorithms))
        assigned |= model.initialized
        system = _system(model, assigned)
        matched = system.matching()
        dependent = {key for key in matched.values() if key[0] in model.states}
        if not dependent:
            break
        model = _Reduction(model, system, matched, assigned).reduce(dependent)
    return model


def _system(model: Model, assigned: set[str]) -> EquationSystem:
    known = given_variables(model) | assigned
    keys: list[ScalarKey] = []
    for name in model.variables:
        if name not in known:
            keys += scalar_keys(model.variables, Name(name))
    groups: list[list[ScalarKey]] = [[], [], []]
    for key in keys:
        if key[0] in model.states:
            variable = model.variables[key[0]]
            groups[2 if variable.shape else bool(variable.fixed)].append(key)
    return EquationSystem(
        model, model.equations, {key for key in keys if key[0] not in model.states}, groups
    )


class _Reduction:
    def __init__(
        self,
        model: Model,
        system: EquationSystem,
        matched: dict[int, ScalarKey],
        assigned: set[str],
    ):
        self._model, self._system = model, system
        self._equation_of = {
            key: system.scalar_equations[number] for number, key in matched.items()
        }
        self._assigned = assigned
        self._variables = dict(model.variables)
        self._differentiate = Differentiation(model.functions, self._derivative)
        self._pending: list[ScalarKey] = []

    def reduce(self, dependent: set[ScalarKey]) -> Model:
        """Return the model in which the given states are ordinary variables."""
        names = {name for name, _ in dependent}
        for name in names:
            if not scalar_keys(self._model.variables, Name(name)) <= dependent:
                raise_model_error(
                    f"only some elements of the state {name} are determined by equations",
                    self._model.variables[name].where,
                )
        self._refuse_nonlinear_constraints(dependent)
        self._pending = sorted(dependent)
        equations, done = list(self._model.equations), set[ScalarKey]()
        while self._pending:
            key = self._pending.pop()
            if key in done:
                continue
            done.add(key)
            equation = self._equation_of.get(key)
            if equation is None:
                raise_model_error(
                    f"the derivative of {key[0]} is needed, but no equation gives it",
                    self._model.variables[key[0]].where,
                )
            equations.append(
                Equation(
                    self._differentiate(equation.left),
                    self._differentiate(equation.right),
                    equation.where,
                )
            )
        states = tuple(name for name in self._model.states if name not in names)
        return replace(
            self._model, variables=self._variables, states=states, equations=tuple(equations)
        )

    def _refuse_nonlinear_constraints(self, dependent: set[ScalarKey]) -> None:
        """Raise InputError for an equation between states that has no solution at all times."""
        for key in sorted(dependent):
            equation = self._equation_of[key]
            names = variable_names((equation.left, equation.right)) & set(self._model.states)
            if len(names) > 1 and not self._system.is_linear(equation, key):
                raise_model_error(
                    f"this equation relates the states {', '.join(sorted(names))}, and it is not "
                    f"linear in {key[0]}: "
                    "such an index reduction is not supported; write the model with independent "
                    "states",
                    equation.where,
                )

    def _derivative(self, reference: Name | Index) -> Expression | None:
        """Return the derivative of a variable with respect to time."""
        name = referenced_variable(reference)
        if name == "time":
            return Literal(1.0, "Real")
        variable = self._variables.get(name)
        if variable is None or not is_continuous(variable) or name in self._assigned:
            return None
        if is_input(variable):
            raise_model_error(
                f"the derivative of the input {name} is needed; filter the input", variable.where
            )
        whole = derivative_name(name)
        if whole in self._variables:
            target = Name(whole, getattr(reference, "where", None))
            return replace(reference, base=target) if isinstance(reference, Index) else target
        keys = scalar_keys(self._model.variables, reference)
        if len(keys) != 1:
            return Literal(1.0, "Real")  # the caller only needs to know that it changes with time
        key = next(iter(keys))
        element = f"{key[0]}[{key[1] + 1}]" if variable.shape else key[0]
        name = derivative_name(element)
        if name not in self._variables:
            self._variables[name] = replace(derivative_variable(variable), name=name, shape=())
            self._pending.append(key)
        return Name(name)
