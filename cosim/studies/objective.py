"""Arithmetic expressions of KPIs, such as `landing.lateral_error + 0.1 * max(motors.max_speed - 400, 0)`.

They consist of numbers, names, `+ - * / **`, parentheses and a few functions; constraints also compare with `<=` or `>=`.
Python's `eval` is never used.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..core.errors import did_you_mean

#: longest expression (characters)
_MAX_LENGTH = 1000
_BINARY_OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: lambda a, b: math.pow(a, b),
}
_UNARY_OPERATORS: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}


class AllowedFunction(NamedTuple):
    """Function of an expression: the permitted numbers of arguments, and a text that states them."""

    call: Callable[..., float]
    counts: range = range(1, 2)
    expected: str = "1 argument"


_TWO_OR_MORE = range(2, _MAX_LENGTH), "2 arguments or more"
FUNCTIONS: Mapping[str, AllowedFunction] = {
    "abs": AllowedFunction(abs),
    "min": AllowedFunction(min, *_TWO_OR_MORE),
    "max": AllowedFunction(max, *_TWO_OR_MORE),
    "sqrt": AllowedFunction(math.sqrt),
    "exp": AllowedFunction(math.exp),
    "log": AllowedFunction(math.log, range(1, 3), "1 or 2 arguments"),
}
_GRAMMAR_HINT = f"numbers, KPIs, + - * / ** and {', '.join(FUNCTIONS)}"


@dataclass(frozen=True)
class Expression:
    """Valid arithmetic expression; calling it with KPIs returns its value."""

    text: str
    tree: ast.expr

    @property
    def names(self) -> list[str]:
        """Names of the KPIs and parameters in the expression."""
        return list(dict.fromkeys(_kpi_names(self.tree)))

    def unknown_name_problem(self, known: Mapping[str, Any]) -> str:
        """Return a message about the first name that is not `known`; "" if all are."""
        missing = [name for name in self.names if name not in known]
        return f'no KPI or parameter "{missing[0]}"{did_you_mean(missing[0], known)}' if missing else ""

    def __call__(self, values: Mapping[str, float]) -> float:
        """Return the value; NaN if any part is undefined, as after a division by zero or with a KPI that is NaN or missing."""
        try:
            return _evaluate(self.tree, values)
        except (ArithmeticError, ValueError):
            return math.nan


@dataclass(frozen=True)
class Constraint:
    """Constraint `left <= right`."""

    left: Expression
    right: Expression

    @property
    def names(self) -> list[str]:
        """Names of the KPIs and parameters on both sides."""
        return [*self.left.names, *self.right.names]

    def violation(self, values: Mapping[str, float]) -> float:
        """Return by how much the constraint is violated: 0 if it is met, infinity if a side is NaN."""
        excess = self.left(values) - self.right(values)
        return math.inf if math.isnan(excess) else max(0.0, excess)


def parse_expression(text: str) -> Expression:
    """Parse an arithmetic expression; raise ValueError if it is invalid."""
    tree = _parse(text)
    _check_node(tree)
    return Expression(text, tree)


def parse_constraint(text: str) -> Constraint:
    """Parse `a <= b` or `a >= b`; raise ValueError if it is invalid."""
    tree = _parse(text)
    if not (isinstance(tree, ast.Compare) and len(tree.ops) == 1 and isinstance(tree.ops[0], ast.LtE | ast.GtE)):
        raise ValueError(f'expected a comparison with <= or >=, found "{text}"')
    sides = [Expression(ast.unparse(side), side) for side in (tree.left, tree.comparators[0])]
    for side in sides:
        _check_node(side.tree)
    left, right = sides if isinstance(tree.ops[0], ast.LtE) else sides[::-1]
    return Constraint(left, right)


def _parse(text: str) -> ast.expr:
    if len(text) > _MAX_LENGTH:
        raise ValueError(f"expected at most {_MAX_LENGTH} characters, found {len(text)}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f'"{text}" is not an expression: {getattr(error, "msg", error)}') from None


def _check_node(node: ast.AST) -> None:
    """Raise ValueError for the first part that is not allowed in an expression."""
    match node:
        case ast.Constant(value=value) if isinstance(value, int | float) and not isinstance(value, bool):
            return
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY_OPERATORS:
            _check_node(left)
            _check_node(right)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY_OPERATORS:
            _check_node(operand)
        case ast.Call(func=ast.Name(id=name), args=[_, *_] as arguments, keywords=[]):
            if name not in FUNCTIONS:
                raise ValueError(f'unknown function "{name}"{did_you_mean(name, FUNCTIONS)}')
            for argument in arguments:
                _check_node(argument)
            if len(arguments) not in FUNCTIONS[name].counts:
                raise ValueError(f'"{name}" takes {FUNCTIONS[name].expected}, found {len(arguments)}')
        case _ if _kpi_name(node):
            return
        case _:
            raise ValueError(f'"{ast.unparse(node)}" is not allowed here; expected {_GRAMMAR_HINT}')


def _kpi_name(node: ast.AST) -> str:
    """Return the KPI name that a node spells, such as "landing.time[2]"; "" for any other node."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=inner, attr=name):
            return f"{outer}.{name}" if (outer := _kpi_name(inner)) else ""
        case ast.Subscript(value=inner, slice=ast.Constant(value=int(index))):
            return f"{outer}[{index}]" if (outer := _kpi_name(inner)) else ""
    return ""


def _kpi_names(node: ast.AST) -> Iterator[str]:
    if name := _kpi_name(node):
        yield name
        return
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Call) and child is node.func):
            yield from _kpi_names(child)


def _evaluate(node: ast.AST, values: Mapping[str, float]) -> float:
    """Return the value of a node; raise ArithmeticError for NaN, which `min`, `max` and `**` would sometimes drop."""
    value = float(_evaluate_node(node, values))
    if math.isnan(value):
        raise ArithmeticError
    return value


def _evaluate_node(node: ast.AST, values: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as value):
            return value
        case ast.BinOp(left=left, op=op, right=right):
            return float(_BINARY_OPERATORS[type(op)](_evaluate(left, values), _evaluate(right, values)))
        case ast.UnaryOp(op=op, operand=operand):
            return float(_UNARY_OPERATORS[type(op)](_evaluate(operand, values)))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return FUNCTIONS[name].call(*(_evaluate(argument, values) for argument in arguments))
    return values.get(_kpi_name(node), math.nan)
