"""Arithmetic over KPIs, as text: `landing.lateral_error + 0.1 * max(motors.max_speed - 400, 0)`.

Only numbers, names, `+ - * / **`, comparisons, brackets and a few functions mean anything; nothing is ever evaluated by Python.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ..core.errors import did_you_mean

#: characters
_LONGEST = 1000
_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: lambda a, b: math.pow(a, b),
}
_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos}


class Function(NamedTuple):
    """What can be called, with how many arguments, and that in words."""

    call: Callable[..., float]
    counts: range = range(1, 2)
    expected: str = "1 argument"


_SEVERAL = range(2, _LONGEST), "2 arguments or more"
FUNCTIONS: Mapping[str, Function] = {
    "abs": Function(abs),
    "min": Function(min, *_SEVERAL),
    "max": Function(max, *_SEVERAL),
    "sqrt": Function(math.sqrt),
    "exp": Function(math.exp),
    "log": Function(math.log, range(1, 3), "1 or 2 arguments"),
}
_EXPECTED = f"numbers, KPIs, + - * / ** and {', '.join(FUNCTIONS)}"


@dataclass(frozen=True)
class Expression:
    """A checked expression."""

    text: str
    tree: ast.expr

    @property
    def names(self) -> list[str]:
        """The KPIs and parameters that it needs."""
        return list(dict.fromkeys(_names(self.tree)))

    def unknown(self, known: Mapping[str, Any]) -> str:
        """Why it cannot be evaluated with these names; "" when it can."""
        missing = [name for name in self.names if name not in known]
        return f'no KPI or parameter "{missing[0]}"{did_you_mean(missing[0], known)}' if missing else ""

    def __call__(self, values: Mapping[str, float]) -> float:
        """Its value; NaN where it or a part of it has none, as at a division by zero or of a KPI that is NaN or missing."""
        try:
            return _value(self.tree, values)
        except (ArithmeticError, ValueError):
            return math.nan


@dataclass(frozen=True)
class Constraint:
    """`left <= right`."""

    left: Expression
    right: Expression

    @property
    def names(self) -> list[str]:
        return [*self.left.names, *self.right.names]

    def violation(self, values: Mapping[str, float]) -> float:
        """By how much it is not met, 0 where it is; infinite where a side has no value."""
        excess = self.left(values) - self.right(values)
        return math.inf if math.isnan(excess) else max(0.0, excess)


def expression(text: str) -> Expression:
    """Read arithmetic. Raises ValueError that says what is wrong with it."""
    tree = _parsed(text)
    _check(tree)
    return Expression(text, tree)


def constraint(text: str) -> Constraint:
    """Read `a <= b` or `a >= b`. Raises ValueError that says what is wrong with it."""
    tree = _parsed(text)
    if not (isinstance(tree, ast.Compare) and len(tree.ops) == 1 and isinstance(tree.ops[0], ast.LtE | ast.GtE)):
        raise ValueError(f'expected a comparison with <= or >=, found "{text}"')
    sides = [Expression(ast.unparse(side), side) for side in (tree.left, tree.comparators[0])]
    for side in sides:
        _check(side.tree)
    left, right = sides if isinstance(tree.ops[0], ast.LtE) else sides[::-1]
    return Constraint(left, right)


def _parsed(text: str) -> ast.expr:
    if len(text) > _LONGEST:
        raise ValueError(f"expected at most {_LONGEST} characters, found {len(text)}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise ValueError(f'"{text}" is no expression: {getattr(error, "msg", error)}') from None


def _check(node: ast.AST) -> None:
    """Raises ValueError at the first part that means nothing here."""
    match node:
        case ast.Constant(value=value) if isinstance(value, int | float) and not isinstance(value, bool):
            return
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            _check(left)
            _check(right)
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY:
            _check(operand)
        case ast.Call(func=ast.Name(id=name), args=[_, *_] as arguments, keywords=[]):
            if name not in FUNCTIONS:
                raise ValueError(f'unknown function "{name}"{did_you_mean(name, FUNCTIONS)}')
            for argument in arguments:
                _check(argument)
            if len(arguments) not in FUNCTIONS[name].counts:
                raise ValueError(f'"{name}" takes {FUNCTIONS[name].expected}, found {len(arguments)}')
        case _ if _name(node):
            return
        case _:
            raise ValueError(f'"{ast.unparse(node)}" means nothing here; expected {_EXPECTED}')


def _name(node: ast.AST) -> str:
    """ "landing.time[2]" as the name of a KPI; "" for what is none."""
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=inner, attr=name):
            return f"{outer}.{name}" if (outer := _name(inner)) else ""
        case ast.Subscript(value=inner, slice=ast.Constant(value=int(index))):
            return f"{outer}[{index}]" if (outer := _name(inner)) else ""
    return ""


def _names(node: ast.AST) -> Iterator[str]:
    if name := _name(node):
        yield name
        return
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Call) and child is node.func):
            yield from _names(child)


def _value(node: ast.AST, values: Mapping[str, float]) -> float:
    """Raises ArithmeticError or ValueError without one: `min`, `max` and `**` by themselves would drop some NaN."""
    value = float(_computed(node, values))
    if math.isnan(value):
        raise ArithmeticError
    return value


def _computed(node: ast.AST, values: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as value):
            return value
        case ast.BinOp(left=left, op=op, right=right):
            return float(_BINARY[type(op)](_value(left, values), _value(right, values)))
        case ast.UnaryOp(op=op, operand=operand):
            return float(_UNARY[type(op)](_value(operand, values)))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return FUNCTIONS[name].call(*(_value(argument, values) for argument in arguments))
    return values.get(_name(node), math.nan)
