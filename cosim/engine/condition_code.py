"""Instructions for a stack machine that evaluates a condition in C (`_native.c`)."""

from __future__ import annotations

import ast
import math
from collections.abc import Sequence
from typing import NamedTuple

from ..core.expressions import spelt_name

_BINARY = {
    ast.Add: "ADD",
    ast.Sub: "SUBTRACT",
    ast.Mult: "MULTIPLY",
    ast.Div: "DIVIDE",
    ast.Pow: "POWER",
}
_UNARY = {ast.USub: "NEGATE", ast.Not: "NOT"}
_COMPARISONS = {
    ast.Lt: "LT",
    ast.LtE: "LE",
    ast.Gt: "GT",
    ast.GtE: "GE",
    ast.Eq: "EQ",
    ast.NotEq: "NE",
}


class Instruction(NamedTuple):
    """One instruction.

    PUSH puts `value` on the stack, LOAD the value of the signal `name`. AND and OR remove the
    topmost value if the further operands matter; otherwise they replace it by the result and skip
    the next `skip` instructions. The other operations replace the topmost one or two values by
    their result.
    """

    operation: str
    value: float = 0.0
    name: str = ""
    skip: int = 0


def compile_condition(node: ast.expr) -> list[Instruction]:
    """Return the instructions that leave the value of a valid expression on the stack."""
    match node:
        case ast.Constant(value=int() | float() as value):
            return [Instruction("PUSH", _as_float(value))]
        case ast.BinOp(left=left, op=op, right=right):
            return [
                *compile_condition(left),
                *compile_condition(right),
                Instruction(_BINARY[type(op)]),
            ]
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return compile_condition(operand)
        case ast.UnaryOp(op=op, operand=operand):
            return [*compile_condition(operand), Instruction(_UNARY[type(op)])]
        case ast.BoolOp(op=op, values=values):
            return _combine(
                "OR" if isinstance(op, ast.Or) else "AND",
                [compile_condition(value) for value in values],
            )
        case ast.Compare(left=left, ops=ops, comparators=right_sides):
            sides = [compile_condition(side) for side in (left, *right_sides)]
            pairs = zip(ops, sides, sides[1:], strict=False)
            return _combine(
                "AND", [[*a, *b, Instruction(_COMPARISONS[type(op)])] for op, a, b in pairs]
            )
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _compile_call(name, [compile_condition(argument) for argument in arguments])
    return [Instruction("LOAD", name=spelt_name(node))]


def _as_float(value: float) -> float:
    """Return a constant; NaN, which is no value, for an integer that is too large."""
    try:
        return float(value)
    except OverflowError:
        return math.nan


def _combine(operation: str, parts: Sequence[Sequence[Instruction]]) -> list[Instruction]:
    """Return the instructions of `and` or `or`, which evaluate an operand only if it matters."""
    code = [*parts[-1], Instruction("TRUTH")]
    for part in reversed(parts[:-1]):
        code = [*part, Instruction(operation, skip=len(code)), *code]
    return code


def _compile_call(name: str, arguments: Sequence[Sequence[Instruction]]) -> list[Instruction]:
    first, *others = arguments
    if name == "log":  # to a base: the quotient of two logarithms
        quotient = [Instruction("DIVIDE")] * len(others)
        return [
            *first,
            Instruction("LOG"),
            *(part for each in others for part in (*each, Instruction("LOG"))),
            *quotient,
        ]
    operation = Instruction(name.upper())
    if not others:
        return [*first, operation]
    return [*first, *(part for each in others for part in (*each, operation))]
