"""Symbolic differentiation of scalar expressions, for Jacobians and for index reduction.

The rules of sums, products and powers are here, those of functions are in the table of built-in
functions. `leaf` decides with respect to what an expression is differentiated. Calls of functions
that consist of one assignment are expanded first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from ..model.builtin_functions import BUILTIN_FUNCTIONS
from ..model.flat_model import Function
from ..model.simplification import ZERO, add, divide, multiply, negate, square, subtract
from ..model.syntax_tree import (
    Assign,
    Binary,
    Builtin,
    Call,
    Expression,
    If,
    Index,
    Literal,
    Name,
    Unary,
    raise_model_error,
)
from ..model.traversal import rewrite, variable_names

#: derivative of a variable or of `time`; None where it is zero
LeafDerivative: TypeAlias = "Callable[[Name | Index], Expression | None]"


class Differentiation:
    """Differentiation of expressions with respect to what `leaf` defines.

    A variable, or the time.
    """

    def __init__(self, functions: Mapping[str, Function], leaf: LeafDerivative):
        self._functions = functions
        self._leaf = leaf

    def __call__(self, node: Expression) -> Expression:
        """Return the derivative of a scalar expression.

        Raises:
            InputError: The expression contains a function whose derivative is not known.
        """
        if isinstance(node, Literal):
            return ZERO
        if isinstance(node, Name) or (isinstance(node, Index) and isinstance(node.base, Name)):
            return self._leaf(node) or ZERO
        if not any(self._leaf(Name(name)) for name in variable_names(node)):
            return ZERO
        if isinstance(node, Unary):
            return negate(self(node.operand))
        if isinstance(node, If):
            return If(
                tuple((condition, self(value)) for condition, value in node.branches),
                self(node.otherwise),
            )
        if isinstance(node, Binary):
            return self._binary(node)
        if isinstance(node, Call) and (inlined := inline_call(node, self._functions)) is not None:
            return self(inlined)
        if not isinstance(node, Builtin):
            raise_model_error(
                "this expression cannot be differentiated", getattr(node, "where", None)
            )
        return self._builtin(node)

    def _binary(self, node: Binary) -> Expression:
        operator, a, b = node.operator.removeprefix("."), node.left, node.right
        if operator in "+-":
            return (add if operator == "+" else subtract)(self(a), self(b))
        if operator == "*":
            return add(multiply(self(a), b), multiply(a, self(b)))
        if operator == "/":
            return subtract(divide(self(a), b), divide(multiply(a, self(b)), square(b)))
        if operator != "^":
            raise_model_error(f"the operator {operator} cannot be differentiated", node.where)
        return self._power(a, b)

    def _power(self, a: Expression, b: Expression) -> Expression:
        if isinstance(b, Literal):
            lower = a if b.number == 2 else Binary("^", a, Literal(b.number - 1, b.type))
            return multiply(multiply(Literal(float(b.number), "Real"), lower), self(a))
        inner = multiply(divide(b, a), self(a))
        return multiply(Binary("^", a, b), add(inner, multiply(Builtin("log", (a,)), self(b))))

    def _builtin(self, node: Builtin) -> Expression:
        derivative = BUILTIN_FUNCTIONS[node.name].derivative
        result = derivative(self, *node.arguments) if derivative else None
        return result or raise_model_error(f"{node.name}() cannot be differentiated", node.where)


def inline_call(call: Call, functions: Mapping[str, Function]) -> Expression | None:
    """Return the value of a call of a function with one assignment to a scalar, else None."""
    function = functions.get(call.function)
    if function is None or function.locals or len(function.outputs) != 1 or len(function.body) != 1:
        return None
    (statement,) = function.body
    if not (isinstance(statement, Assign) and isinstance(statement.target, Name)):
        return None
    arguments = dict(zip((local.name for local in function.inputs), call.arguments, strict=True))

    def substitute(node: Any) -> Any:
        return arguments.get(node.name, node) if isinstance(node, Name) else node

    value: Expression = rewrite(statement.value, substitute)
    return value
