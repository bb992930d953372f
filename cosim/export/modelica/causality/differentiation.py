"""Symbolic differentiation of scalar expressions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from ..model.flat_model import Function
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

ZERO, ONE = Literal(0.0, "Real"), Literal(1.0, "Real")
#: derivative of a variable or of `time`; None where it is zero
LeafDerivative: TypeAlias = "Callable[[Name | Index], Expression | None]"


def add(a: Expression, b: Expression) -> Expression:
    """Return a + b, without terms that are zero."""
    return b if a == ZERO else a if b == ZERO else Binary("+", a, b)


def subtract(a: Expression, b: Expression) -> Expression:
    """Return a - b, without terms that are zero."""
    return a if b == ZERO else negate(b) if a == ZERO else Binary("-", a, b)


def multiply(a: Expression, b: Expression) -> Expression:
    """Return a * b, simplified if one factor is zero or one."""
    if ZERO in (a, b):
        return ZERO
    return b if a == ONE else a if b == ONE else Binary("*", a, b)


def divide(a: Expression, b: Expression) -> Expression:
    """Return a / b, simplified if a is zero or b is one."""
    return ZERO if a == ZERO else a if b == ONE else Binary("/", a, b)


def negate(a: Expression) -> Expression:
    """Return -a."""
    if isinstance(a, Literal) and a.type == "Real":
        return Literal(-a.number if a.number else 0.0, "Real")
    return a.operand if isinstance(a, Unary) and a.operator == "-" else Unary("-", a)


def _function(name: str, *arguments: Expression) -> Expression:
    return Builtin(name, arguments)


def _square(x: Expression) -> Expression:
    return Binary("^", x, Literal(2, "Integer"))


#: derivative of each function with respect to its argument
_DERIVATIVES: Mapping[str, Callable[[Expression], Expression]] = {
    "sin": lambda x: _function("cos", x),
    "cos": lambda x: negate(_function("sin", x)),
    "tan": lambda x: add(ONE, _square(_function("tan", x))),
    "asin": lambda x: divide(ONE, _function("sqrt", subtract(ONE, _square(x)))),
    "acos": lambda x: negate(divide(ONE, _function("sqrt", subtract(ONE, _square(x))))),
    "atan": lambda x: divide(ONE, add(ONE, _square(x))),
    "sinh": lambda x: _function("cosh", x),
    "cosh": lambda x: _function("sinh", x),
    "tanh": lambda x: subtract(ONE, _square(_function("tanh", x))),
    "exp": lambda x: _function("exp", x),
    "log": lambda x: divide(ONE, x),
    "log10": lambda x: divide(Literal(0.4342944819032518, "Real"), x),
    "sqrt": lambda x: divide(Literal(0.5, "Real"), _function("sqrt", x)),
    "abs": lambda x: If(
        ((Builtin("noEvent", (Binary("<", x, ZERO),)), Literal(-1.0, "Real")),), ONE
    ),
}


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
            return subtract(divide(self(a), b), divide(multiply(a, self(b)), _square(b)))
        if operator != "^":
            raise_model_error(f"the operator {operator} cannot be differentiated", node.where)
        return self._power(a, b)

    def _power(self, a: Expression, b: Expression) -> Expression:
        if isinstance(b, Literal):
            lower = a if b.number == 2 else Binary("^", a, Literal(b.number - 1, b.type))
            return multiply(multiply(Literal(float(b.number), "Real"), lower), self(a))
        inner = multiply(divide(b, a), self(a))
        return multiply(Binary("^", a, b), add(inner, multiply(_function("log", a), self(b))))

    def _builtin(self, node: Builtin) -> Expression:
        arguments = node.arguments
        if node.name in ("noEvent", "homotopy"):
            return self(arguments[0])
        if node.name == "smooth":
            return self(arguments[1])
        if node.name in ("min", "max") and len(arguments) == 2:
            first = Binary("<" if node.name == "min" else ">", *arguments)
            return If(((Builtin("noEvent", (first,)), self(arguments[0])),), self(arguments[1]))
        if node.name == "atan2":
            y, x = arguments
            return divide(
                subtract(multiply(x, self(y)), multiply(y, self(x))), add(_square(x), _square(y))
            )
        if node.name in ("pre", "sign", "integer", "floor", "ceil"):
            return ZERO
        if node.name not in _DERIVATIVES:
            raise_model_error(f"{node.name}() cannot be differentiated", node.where)
        return multiply(_DERIVATIVES[node.name](arguments[0]), self(arguments[0]))


def inline_call(call: Call, functions: Mapping[str, Function]) -> Expression | None:
    """Return the value of a call of a function that consists of one assignment to a scalar result, else None."""
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
