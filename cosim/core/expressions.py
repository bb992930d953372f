"""Expressions of named values, such as `landing.error + 0.1 * max(motors.max_speed - 400, 0)`.

They consist of numbers, names, `+ - * / **`, parentheses and a few functions. Conditions also
compare and combine with `and`, `or` and `not`. Python's `eval` is never used.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from keyword import iskeyword
from typing import Any, NamedTuple

from .errors import near_or_valid_names

#: function without arguments that returns the present value of a part of an expression
Reader = Callable[[], float]

#: longest expression (characters)
_MAX_LENGTH = 1000
_WORD = re.compile(r"[A-Za-z_]+")
_BINARY_OPERATORS: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: lambda a, b: math.pow(a, b),
}
_UNARY_OPERATORS: Mapping[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_COMPARISONS: Mapping[type[ast.cmpop], Callable[[Any, Any], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
}


class AllowedFunction(NamedTuple):
    """Function of an expression.

    The permitted numbers of arguments, and a text that states them.
    """

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


@dataclass(frozen=True)
class Expression:
    """Valid expression; calling it with values by name returns its value."""

    text: str
    tree: ast.expr

    @property
    def names(self) -> list[str]:
        """Names in the expression."""
        return list(dict.fromkeys(_names(self.tree)))

    def unknown_name_problem(self, known: Mapping[str, Any], kind: str = "KPI or parameter") -> str:
        """Return a message about the first name that is not `known`; "" if all are."""
        missing = [name for name in self.names if name not in known]
        return (
            f'no {kind} "{missing[0]}"{near_or_valid_names(missing[0], known)}' if missing else ""
        )

    def bind(self, reader: Callable[[str], Reader]) -> Reader:
        """Return a function that returns the present value.

        The value is NaN if any part is undefined, as after a division by zero or with a value that
        is NaN. The second operand of `and` and `or` is evaluated only if it matters.

        Args:
            reader: Returns for each name a function that returns its present value.
        """
        evaluate = _bind(self.tree, reader)

        def value() -> float:
            try:
                return evaluate()
            except (ArithmeticError, ValueError):
                return math.nan

        return value

    def __call__(self, values: Mapping[str, float]) -> float:
        """Return the value; NaN if any part is undefined or missing."""
        return self.bind(lambda name: lambda: values.get(name, math.nan))()

    @property
    def alternatives(self) -> Sequence[Expression]:
        """Operands of the outermost `or`; the expression itself if there is none."""
        match self.tree:
            case ast.BoolOp(op=ast.Or(), values=values):
                return [Expression(ast.unparse(value), value) for value in values]
        return [self]


def parse_expression(text: str) -> Expression:
    """Parse an arithmetic expression; raise ValueError if it is invalid."""
    tree = parse_syntax(text)
    check_node(tree)
    return Expression(text, tree)


def parse_condition(text: str) -> Expression:
    """Parse an expression with comparisons, `and`, `or` and `not`, whose value is 0 or not.

    Raise ValueError if it is invalid.
    """
    tree = parse_syntax(text)
    check_node(tree, conditions=True)
    return Expression(text, tree)


def parse_syntax(text: str) -> ast.expr:
    """Return the syntax tree of an expression; raise ValueError if there is none."""
    if len(text) > _MAX_LENGTH:
        raise ValueError(f"expected at most {_MAX_LENGTH} characters, found {len(text)}")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reserved = [
            word
            for word in _WORD.findall(text)
            if iskeyword(word) and word not in ("and", "or", "not")
        ]
        reason = (
            f'"{reserved[0]}" is a reserved word of Python'
            if reserved
            else getattr(error, "msg", error)
        )
        raise ValueError(f'"{text}" is not an expression: {reason}') from None


def check_node(node: ast.AST, conditions: bool = False) -> None:
    """Raise ValueError for the first part that is not allowed in an expression.

    Args:
        node: Syntax tree.
        conditions: Allow comparisons, `and`, `or` and `not`.
    """
    match node:
        case ast.Constant(value=value) if isinstance(value, int | float) and not isinstance(
            value, bool
        ):
            operands: Sequence[ast.AST] = ()
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY_OPERATORS:
            operands = left, right
        case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY_OPERATORS or (
            conditions and isinstance(op, ast.Not)
        ):
            operands = (operand,)
        case ast.BoolOp(values=values) if conditions:
            operands = values
        case ast.Compare(left=left, ops=ops, comparators=right_sides) if conditions and all(
            type(o) in _COMPARISONS for o in ops
        ):
            operands = left, *right_sides
        case ast.Call(func=ast.Name(id=name), args=[_, *_] as arguments, keywords=[]):
            if name not in FUNCTIONS:
                raise ValueError(f'unknown function "{name}"{near_or_valid_names(name, FUNCTIONS)}')
            for argument in arguments:
                check_node(argument, conditions)
            if len(arguments) not in FUNCTIONS[name].counts:
                expected = FUNCTIONS[name].expected
                raise ValueError(f'"{name}" takes {expected}, found {len(arguments)}')
            operands = ()
        case _ if spelt_name(node):
            operands = ()
        case _:
            more = ", comparisons, and, or, not" if conditions else ""
            hint = f"numbers, names, + - * / **{more} and {', '.join(FUNCTIONS)}"
            raise ValueError(f'"{ast.unparse(node)}" is not allowed here; expected {hint}')
    for part in operands:
        check_node(part, conditions)


def spelt_name(node: ast.AST) -> str:
    """Return the name that a syntax node spells, such as "landing.time[2]" or "plant.a[1,2]".

    "" for any other node.
    """
    match node:
        case ast.Name(id=name):
            return name
        case ast.Attribute(value=inner, attr=name):
            return f"{outer}.{name}" if (outer := spelt_name(inner)) else ""
        case ast.Subscript(value=inner, slice=ast.Constant(value=int(index))):
            return f"{outer}[{index}]" if (outer := spelt_name(inner)) else ""
        case ast.Subscript(value=inner, slice=ast.Tuple(elts=elements)) if outer := spelt_name(
            inner
        ):
            indices = [element.value for element in elements if isinstance(element, ast.Constant)]
            return (
                f"{outer}[{','.join(map(str, indices))}]" if len(indices) == len(elements) else ""
            )
    return ""


def _names(node: ast.AST) -> Iterator[str]:
    if name := spelt_name(node):
        yield name
        return
    for child in ast.iter_child_nodes(node):
        if not (isinstance(node, ast.Call) and child is node.func):
            yield from _names(child)


def _bind(node: ast.AST, reader: Callable[[str], Reader]) -> Reader:
    """Return a function that evaluates a node.

    It raises ArithmeticError for NaN, which `min`, `max`, `**` and comparisons would drop.
    """
    evaluate = _bind_operation(node, reader)

    def value() -> float:
        found = float(evaluate())
        if found != found:
            raise ArithmeticError
        return found

    return value


def _bind_operation(node: ast.AST, reader: Callable[[str], Reader]) -> Callable[[], Any]:
    match node:
        case ast.Constant(value=value):
            return lambda: value
        case ast.BinOp(left=left, op=op, right=right):
            first, second, binary = (
                _bind(left, reader),
                _bind(right, reader),
                _BINARY_OPERATORS[type(op)],
            )
            return lambda: binary(first(), second())
        case ast.UnaryOp(op=op, operand=operand):
            inner, unary = _bind(operand, reader), _UNARY_OPERATORS.get(type(op), operator.not_)
            return lambda: unary(inner())
        case ast.BoolOp(op=op, values=values):
            parts, combine = (
                [_bind(value, reader) for value in values],
                any if isinstance(op, ast.Or) else all,
            )
            return lambda: combine(part() for part in parts)
        case ast.Compare(left=left, ops=ops, comparators=right_sides):
            sides = [_bind(side, reader) for side in (left, *right_sides)]
            pairs = [
                (_COMPARISONS[type(op)], a, b)
                for op, a, b in zip(ops, sides, sides[1:], strict=False)
            ]
            return lambda: all(compare(a(), b()) for compare, a, b in pairs)
        case ast.Call(func=ast.Name(id=name), args=arguments):
            terms, function = (
                [_bind(argument, reader) for argument in arguments],
                FUNCTIONS[name].call,
            )
            return lambda: function(*(term() for term in terms))
    return reader(spelt_name(node))
